//! Profile likelihoods as a chart.

use super::chart::{Chart, Form, Panel, Series};
use motorfit_core::numeric::count;
use motorfit_identify::{LIKELIHOOD_LIMIT as LIMIT, LikelihoodPoint, LikelihoodProfile};

/// Number of points of the curve by the standard error.
const POINTS: usize = 61;
/// Number of parts between two points of a profile.
const PARTS: usize = 6;
/// Largest likelihood ratio that is drawn.
const DRAWN: f64 = 2.5 * LIMIT;

/// Returns a chart of profile likelihoods, each beside the parabola of its standard error.
#[must_use]
pub fn likelihood_chart(profiles: &[LikelihoodProfile]) -> Chart {
    Chart {
        id: "likelihood".to_owned(),
        panels: profiles.iter().map(panel).collect(),
        is_grid: true,
        alternative: "Profile likelihood of each parameter, with the parabola of its standard error".to_owned(),
        caption: format!(
            "Likelihood ratio over each parameter, all others refined; below {LIMIT} is the 95 % interval. The parabola is that of the \
             standard error."
        ),
        ..Chart::default()
    }
}

/// Returns a smooth curve through the points: between them the signed root of the ratio is nearly linear.
fn curve(of: &LikelihoodProfile) -> Vec<(f64, f64)> {
    let root = |point: &LikelihoodPoint| point.ratio.max(0.0).sqrt().copysign(point.value - of.value);
    let between = |pair: &[LikelihoodPoint]| {
        let [(x0, y0), (x1, y1)] = [&pair[0], &pair[1]].map(|point| (point.value, root(point)));
        let part = |n: usize| count(n) / count(PARTS);
        (0..=PARTS).map(part).map(move |t| (x0 + t * (x1 - x0), (y0 + t * (y1 - y0)).powi(2))).collect::<Vec<_>>()
    };
    of.points.windows(2).flat_map(between).filter(|point| point.1 <= DRAWN).collect()
}

fn panel(of: &LikelihoodProfile) -> Panel {
    let parabola = of.std_error.map_or_else(Vec::new, |error| {
        let reach = DRAWN.sqrt();
        let point = |n: usize| {
            let distance = reach * (2.0 * count(n) / count(POINTS - 1) - 1.0);
            (of.value + distance * error, distance * distance)
        };
        (0..POINTS).map(point).collect()
    });
    let ends = of.likelihood95.iter().flatten().copied().collect();
    Panel {
        axis: Some(format!("{} [{}]", of.name, of.unit.replace('*', " "))),
        limits: [ends, vec![LIMIT]],
        ..Panel::new(
            &format!("likelihood ratio over {}", if of.description.is_empty() { &of.name } else { &of.description }),
            vec![
                Series::new("standard error", 0, Form::Line, parabola),
                Series::new("profile likelihood", 1, Form::Line, curve(of)),
            ],
        )
    }
}
