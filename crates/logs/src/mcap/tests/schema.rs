//! Message definitions of ROS 2.

use super::super::schema::{Kind, Member, Number, Schema, Shape};

fn parsed(text: &str) -> Result<Schema, String> {
    Schema::ros2("p/msg/M", text, &mut 50)
}

#[test]
fn members_of_all_shapes() {
    let text = "# comment\n\nuint8 ON=1\nstring NAME = \"a\"\nfloat64 x 1.5 # y\r\nint8[3] a\nint8[<=3] b\nint8[] c [1, 2]\n\
                string<=10 s \"k = 1\"\nwstring<=5[] w\nbyte z#end\nIn i\np/msg/In[2] j\nHeader h\ntime t\n\
                ====\nMSG: p/In\nbool on\n";
    let schema = parsed(text).unwrap();
    let number = |name: &str, number, shape| Member { name: name.to_owned(), kind: Kind::Number(number), shape };
    let other = |name: &str, kind, shape| Member { name: name.to_owned(), kind, shape };
    let expected = [
        number("x", Number::F64, Shape::One),
        number("a", Number::I8, Shape::Fixed(3)),
        number("b", Number::I8, Shape::Sequence),
        number("c", Number::I8, Shape::Sequence),
        other("s", Kind::Text, Shape::One),
        other("w", Kind::WideText, Shape::Sequence),
        number("z", Number::U8, Shape::One),
        other("i", Kind::Structure(1), Shape::One),
        other("j", Kind::Structure(1), Shape::Fixed(2)),
        other("h", Kind::Structure(2), Shape::One),
        other("t", Kind::Structure(3), Shape::One),
    ];
    assert_eq!(schema.members(0), expected);
    assert_eq!(schema.members(1), [number("on", Number::Bool, Shape::One)]);
    let time = [number("sec", Number::I32, Shape::One), number("nanosec", Number::U32, Shape::One)];
    assert_eq!(schema.members(3), time);
    assert!(!schema.has_stamp() && schema.has_wide_text());
    assert!(parsed("std_msgs/msg/Header h\nint8 a").unwrap().has_stamp());
    assert!(!parsed("std_msgs/Header[1] h").unwrap().has_stamp());
    assert!(!parsed("std_msgs/Header h\n===\nMSG: std_msgs/Header\nuint32 seq").unwrap().has_stamp());
}

#[test]
fn what_is_not_understood() {
    let deep: String = (0..40).map(|k| format!("===\nMSG: p/T{k}\nT{} x\n", k + 1)).collect();
    let many = "int8 x\n".repeat(51);
    let cases = [
        ("float64", "line \"float64\" declares no member"),
        ("float64 -", "line \"float64 -\" declares no member"),
        ("float64[0] x", "line \"float64[0] x\" declares no member"),
        ("float64[x] x", "line \"float64[x] x\" declares no member"),
        ("float64[2 x", "line \"float64[2 x\" declares no member"),
        ("Other x", "type \"p/Other\" is not defined"),
        ("M x", "type \"p/M\" is not defined"),
        ("A x\n===\nMSG: p/A\nB[] x\n===\nMSG: p/B\nA[] x", "type \"p/A\" is not defined"),
        (&format!("T0 x\n{deep}"), "\"p/T31\" is inside more than 32 types"),
        (&many, "more than 200000 members"),
    ];
    for (text, expected) in cases {
        assert_eq!(parsed(text).unwrap_err(), expected);
    }
}
