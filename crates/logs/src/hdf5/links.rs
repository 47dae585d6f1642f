//! Members of the groups of an HDF5 file.
//!
//! The decoder lists the members of a group only if it understands all of them. Here each is listed, so that one that is
//! damaged or of an unsupported kind does not hide the others.

use hdf5_reader::Hdf5File;
use hdf5_reader::btree_v1::collect_btree_v1_leaves_storage;
use hdf5_reader::btree_v2::{BTreeV2Header, BTreeV2Record, collect_btree_v2_records_storage};
use hdf5_reader::error::{Error, Result};
use hdf5_reader::fractal_heap::{FractalHeap, FractalHeapDirectBlockCache};
use hdf5_reader::io::Cursor;
use hdf5_reader::local_heap::LocalHeap;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::messages::link::{self, LinkMessage, LinkTarget};
use hdf5_reader::messages::link_info::LinkInfoMessage;
use hdf5_reader::messages::symbol_table_msg::SymbolTableMessage;
use hdf5_reader::symbol_table::SymbolTableNode;

/// A member of a group.
pub(super) struct Member {
    pub name: String,
    /// Position of its header; `None` for a link to another file.
    pub address: Option<u64>,
}

/// Returns the members of the group whose header is at `address`, sorted by name, or by time of creation where the file
/// records it. Soft links are left out: they are further names of other members.
///
/// # Errors
/// Returns an error if the group is damaged.
pub(super) fn members(file: &Hdf5File, address: u64) -> Result<Vec<Member>> {
    let header = file.get_or_parse_header(address)?;
    let (mut links, mut members) = (Vec::new(), Vec::new());
    for message in &header.messages {
        match message {
            HdfMessage::SymbolTable(table) => symbols(file, table, &mut members)?,
            HdfMessage::Link(link) => links.push(link.clone()),
            HdfMessage::LinkInfo(info) => dense_links(file, info, &mut links)?,
            _ => {}
        }
    }
    if links.iter().all(|link| link.creation_order.is_some()) {
        links.sort_by_key(|link| link.creation_order);
    } else {
        links.sort_by(|a, b| a.name.cmp(&b.name));
    }
    members.extend(links.into_iter().filter_map(|link| match link.target {
        LinkTarget::Hard { address } => Some(Member { name: link.name, address: Some(address) }),
        LinkTarget::Soft { .. } => None,
        LinkTarget::External { .. } => Some(Member { name: link.name, address: None }),
    }));
    Ok(members)
}

/// Adds the members of a group of the older kind.
fn symbols(file: &Hdf5File, table: &SymbolTableMessage, members: &mut Vec<Member>) -> Result<()> {
    /// Type of an entry that is a soft link.
    const SOFT: u32 = 2;
    let (storage, block) = (file.storage(), file.superblock());
    let (offset, length) = (block.offset_size, block.length_size);
    let heap = LocalHeap::parse_at_storage(storage, table.heap_address, offset, length)?;
    let size = usize::try_from(heap.data_segment_size).map_err(|_| Error::OffsetOutOfBounds(heap.data_segment_size))?;
    let names = storage.read_range(heap.data_segment_address, size)?;
    for (_, address) in collect_btree_v1_leaves_storage(storage, table.btree_address, offset, length, None, &[], None)?
    {
        let start = storage.read_range(address, 8)?;
        let count = start.last_chunk::<2>().map_or(0, |count| usize::from(u16::from_le_bytes(*count)));
        let node = storage.read_range(address, 8 + count * (2 * usize::from(offset) + 24))?;
        for entry in SymbolTableNode::parse(&mut Cursor::new(&node), offset, length)?.entries {
            let start = usize::try_from(entry.link_name_offset).unwrap_or(usize::MAX);
            let name = names.get(start..).and_then(|name| name.split(|&byte| byte == 0).next());
            let name = name.ok_or(Error::OffsetOutOfBounds(entry.link_name_offset))?;
            if entry.cache_type != SOFT {
                let name = String::from_utf8_lossy(name).into_owned();
                members.push(Member { name, address: Some(entry.object_header_address) });
            }
        }
    }
    Ok(())
}

/// Adds the links of a group that are stored outside its header.
fn dense_links(file: &Hdf5File, info: &LinkInfoMessage, links: &mut Vec<LinkMessage>) -> Result<()> {
    let (storage, block) = (file.storage(), file.superblock());
    let (offset, length) = (block.offset_size, block.length_size);
    if Cursor::is_undefined_offset(info.fractal_heap_address, offset) {
        return Ok(());
    }
    let heap = FractalHeap::parse_at_storage(storage, info.fractal_heap_address, offset, length)?;
    if heap.io_filters_len > 0 {
        return Err(Error::UnsupportedEncoding("compressed links".into()));
    }
    let tree = BTreeV2Header::parse_at_storage(storage, info.btree_name_index_address, offset, length)?;
    let mut blocks = FractalHeapDirectBlockCache::default();
    for record in collect_btree_v2_records_storage(storage, &tree, offset, length, None, &[], None)? {
        if let BTreeV2Record::LinkNameHash { heap_id, .. } = record {
            let bytes = heap.get_object_storage_cached(&heap_id, storage, offset, length, &mut blocks)?;
            links.push(link::parse(&mut Cursor::new(&bytes), offset, length, bytes.len())?);
        }
    }
    Ok(())
}
