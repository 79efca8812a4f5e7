//! HDF5 files of groups, datasets and attributes, in the oldest version of the format, which all readers know: groups
//! with a symbol table, contiguous datasets without compression. (HDF5 File Format Specification, version 3.0.)

/// Addresses that lead nowhere.
const NOWHERE: u64 = u64::MAX;
/// Half of the most names in a group, and half of the most children of a node of its tree.
const LEAF: u16 = 32;
const TREE: u16 = 16;

/// Types of numbers.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Byte,
    Whole,
    Real,
}

/// An array.
pub(super) struct Dataset {
    pub name: String,
    kind: Kind,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl Dataset {
    pub(super) fn reals(name: &str, shape: &[usize], values: impl Iterator<Item = f64>) -> Self {
        let bytes = values.flat_map(f64::to_le_bytes).collect();
        Self::new(name, Kind::Real, shape, bytes)
    }

    pub(super) fn whole(name: &str, values: impl IntoIterator<Item = i64>) -> Self {
        let bytes: Vec<u8> = values.into_iter().flat_map(i64::to_le_bytes).collect();
        let count = bytes.len() / 8;
        Self::new(name, Kind::Whole, &[count], bytes)
    }

    pub(super) fn bytes(name: &str, bytes: Vec<u8>) -> Self {
        let count = bytes.len();
        Self::new(name, Kind::Byte, &[count], bytes)
    }

    fn new(name: &str, kind: Kind, shape: &[usize], bytes: Vec<u8>) -> Self {
        let (name, shape) = (name.to_owned(), shape.to_vec());
        Self {
            name,
            kind,
            shape,
            bytes,
        }
    }
}

/// An attribute of a group.
pub(super) enum Attribute {
    Text(&'static str, &'static str),
    Whole(&'static str, Vec<i64>),
}

/// A group; at most 64 members.
#[derive(Default)]
pub(super) struct Group {
    pub name: &'static str,
    pub attributes: Vec<Attribute>,
    pub groups: Vec<Group>,
    pub datasets: Vec<Dataset>,
}

/// The bytes of a file with the given groups at the root.
pub(super) fn file(groups: Vec<Group>) -> Vec<u8> {
    // The superblock is written last, when the addresses are known.
    let mut file = Bytes(vec![0; 96]);
    let root = Group {
        groups,
        ..Group::default()
    };
    let at = file.group(&root);
    let mut head = Bytes(b"\x89HDF\r\n\x1a\n".to_vec());
    head.0.extend([0, 0, 0, 0, 0, 8, 8, 0]);
    head.short(LEAF).short(TREE).word(0);
    let end = file.0.len() as u64;
    head.long(0).long(NOWHERE).long(end).long(NOWHERE);
    head.long(0).entry(&at);
    file.0[..96].copy_from_slice(&head.0);
    file.0
}

/// Address of an object, and of tree and heap if the object is a group.
struct Place {
    object: u64,
    names: Option<[u64; 2]>,
}

/// Bytes in the making.
struct Bytes(Vec<u8>);

impl Bytes {
    fn short(&mut self, x: u16) -> &mut Self {
        self.0.extend(x.to_le_bytes());
        self
    }

    fn word(&mut self, x: u32) -> &mut Self {
        self.0.extend(x.to_le_bytes());
        self
    }

    fn long(&mut self, x: u64) -> &mut Self {
        self.0.extend(x.to_le_bytes());
        self
    }

    /// Fills up to a multiple of eight bytes, and tells the address.
    fn aligned(&mut self) -> u64 {
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        self.0.len() as u64
    }

    /// The part of an entry of a symbol table behind its name.
    fn entry(&mut self, at: &Place) {
        let [tree, heap] = at.names.unwrap_or_default();
        self.long(at.object).word(u32::from(at.names.is_some()));
        self.word(0).long(tree).long(heap);
    }

    /// Writes an object header with these messages.
    fn header(&mut self, messages: &[(u16, Vec<u8>)]) -> u64 {
        let at = self.aligned();
        let mut body = Bytes(Vec::new());
        for (kind, message) in messages {
            let size = message.len().next_multiple_of(8);
            body.short(*kind).short(size as u16).word(0);
            body.0.extend(message);
            body.aligned();
        }
        self.short(1).short(messages.len() as u16).word(1);
        self.word(body.0.len() as u32).word(0);
        self.0.extend(body.0);
        at
    }

    fn dataset(&mut self, set: &Dataset) -> Place {
        let data = self.aligned();
        self.0.extend(&set.bytes);
        let mut layout = Bytes(vec![3, 1]);
        layout.long(data).long(set.bytes.len() as u64);
        // No fill value: every number is written.
        let fill = vec![2, 1, 2, 0];
        let object = self.header(&[
            (1, space(&set.shape)),
            (3, datatype(set.kind)),
            (5, fill),
            (8, layout.0),
        ]);
        let names = None;
        Place { object, names }
    }

    fn group(&mut self, group: &Group) -> Place {
        let mut members: Vec<(&str, Place)> = Vec::new();
        for inner in &group.groups {
            members.push((inner.name, self.group(inner)));
        }
        for set in &group.datasets {
            members.push((&set.name, self.dataset(set)));
        }
        members.sort_by(|a, b| a.0.cmp(b.0));
        // The heap of names begins with an empty one.
        let mut names = Bytes(vec![0; 8]);
        let mut table = Bytes(b"SNOD\x01\x00".to_vec());
        table.short(members.len() as u16);
        let mut last = 0;
        for (name, place) in &members {
            last = names.aligned();
            names.0.extend(name.bytes().chain([0]));
            table.long(last).entry(place);
        }
        names.aligned();
        let whole = 8 + 2 * usize::from(LEAF) * 40;
        table.0.resize(whole, 0);
        let symbols = self.aligned();
        self.0.extend(table.0);
        let data = self.aligned();
        let size = names.0.len() as u64;
        self.0.extend(names.0);
        let heap = self.aligned();
        self.0.extend(b"HEAP\0\0\0\0");
        self.long(size).long(1).long(data);
        let tree = self.aligned();
        self.0.extend(b"TREE\0\0");
        self.short(1).long(NOWHERE).long(NOWHERE);
        self.long(0).long(symbols).long(last);
        // A node has room for all its children.
        let room = 24 + 8 * (4 * usize::from(TREE) + 1);
        self.0.resize(tree as usize + room, 0);
        let mut link = Bytes(Vec::new());
        link.long(tree).long(heap);
        let attributes = group.attributes.iter().map(|one| (12, attribute(one)));
        let messages: Vec<(u16, Vec<u8>)> =
            std::iter::once((17, link.0)).chain(attributes).collect();
        let object = self.header(&messages);
        let names = Some([tree, heap]);
        Place { object, names }
    }
}

/// Message of an attribute.
fn attribute(attribute: &Attribute) -> Vec<u8> {
    let (name, kind, space, data) = match attribute {
        Attribute::Text(name, text) => {
            // A text of fixed length, padded by zeros, in ASCII.
            let mut kind = Bytes(vec![0x13, 1, 0, 0]);
            kind.word(text.len() as u32);
            (name, kind.0, space(&[]), text.as_bytes().to_vec())
        }
        Attribute::Whole(name, values) => {
            let data = values.iter().flat_map(|x| x.to_le_bytes()).collect();
            // One number is no array.
            let shape: &[usize] = if values.len() == 1 {
                &[]
            } else {
                &[values.len()]
            };
            (name, datatype(Kind::Whole), space(shape), data)
        }
    };
    let mut message = Bytes(vec![1, 0]);
    message.short(name.len() as u16 + 1);
    message.short(kind.len() as u16).short(space.len() as u16);
    for part in [[name.as_bytes(), &[0]].concat(), kind, space] {
        message.0.extend(part);
        message.aligned();
    }
    message.0.extend(data);
    message.0
}

/// Message of the shape of an array.
fn space(shape: &[usize]) -> Vec<u8> {
    let mut message = Bytes(vec![1, shape.len() as u8, 0, 0, 0, 0, 0, 0]);
    for side in shape {
        message.long(*side as u64);
    }
    message.0
}

/// Message of a type of numbers.
fn datatype(kind: Kind) -> Vec<u8> {
    let mut message = Bytes(Vec::new());
    match kind {
        Kind::Byte => {
            message.0.extend([0x10, 0, 0, 0]);
            message.word(1).short(0).short(8);
        }
        Kind::Whole => {
            message.0.extend([0x10, 8, 0, 0]);
            message.word(8).short(0).short(64);
        }
        Kind::Real => {
            // IEEE 754: the sign is bit 63, the exponent has 11 bits from bit 52 on.
            message.0.extend([0x11, 0x20, 63, 0]);
            message.word(8).short(0).short(64);
            message.0.extend([52, 11, 0, 52]);
            message.word(1023);
        }
    }
    message.0
}
