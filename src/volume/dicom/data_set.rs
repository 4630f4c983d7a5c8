//! Fields of a file, and their values.
//!
//! Values are borrowed, so a length takes no memory, whatever it claims.

use super::tags::Tag;

/// Fields of a file, or of an item of a sequence, in the file's order.
#[derive(Debug, Default)]
pub(super) struct DataSet<'a> {
    pub fields: Vec<(Tag, Value<'a>)>,
    pub big_endian: bool,
}

#[derive(Debug)]
pub(super) enum Value<'a> {
    Bytes(&'a [u8]),
    Items(Vec<DataSet<'a>>),
}

impl<'a> DataSet<'a> {
    fn value(&self, tag: Tag) -> Option<&Value<'a>> {
        self.fields.iter().find(|(of, _)| *of == tag).map(|(_, value)| value)
    }

    fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        match self.value(tag)? {
            Value::Bytes(bytes) => Some(bytes),
            Value::Items(_) => None,
        }
    }

    /// Items of a sequence; none if it is missing.
    pub fn items(&self, tag: Tag) -> &[DataSet<'a>] {
        match self.value(tag) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    pub fn has(&self, tag: Tag) -> bool {
        self.value(tag).is_some()
    }

    /// A text without the spaces and zeros around it; `None` if it is empty.
    pub fn text(&self, tag: Tag) -> Option<&'a str> {
        let text = str::from_utf8(self.bytes(tag)?).ok()?;
        let text = text.trim_matches([' ', '\0']);
        (!text.is_empty()).then_some(text)
    }

    /// Words of a list.
    pub fn words(&self, tag: Tag) -> impl Iterator<Item = &'a str> {
        self.text(tag).into_iter().flat_map(|text| text.split('\\')).map(str::trim)
    }

    /// Numbers of a list, written as text. A list with another text has none.
    pub fn numbers(&self, tag: Tag) -> Vec<f64> {
        // No list that is read has more.
        let numbers = self.words(tag).take(16).map(|word| word.parse().ok().filter(|n: &f64| n.is_finite()));
        numbers.collect::<Option<_>>().unwrap_or_default()
    }

    /// The first number of a list, written as text.
    pub fn number(&self, tag: Tag) -> Option<f64> {
        self.words(tag).next()?.parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// A whole number of 16 bits.
    pub fn u16(&self, tag: Tag) -> Option<u16> {
        let &[a, b, ..] = self.bytes(tag)? else { return None };
        Some(if self.big_endian { u16::from_be_bytes([a, b]) } else { u16::from_le_bytes([a, b]) })
    }

    /// A whole number of 16 or 32 bits, by its length.
    pub fn integer(&self, tag: Tag) -> Option<u32> {
        let Some(&[a, b, c, d]) = self.bytes(tag).and_then(|bytes| bytes.first_chunk()) else {
            return self.u16(tag).map(u32::from);
        };
        let four = [a, b, c, d];
        Some(if self.big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
    }

    /// Numbers of 64 bits; none if the field has another length.
    pub fn doubles(&self, tag: Tag) -> Vec<f64> {
        let bytes = self.bytes(tag).unwrap_or_default();
        let (eights, rest) = bytes.as_chunks::<8>();
        if !rest.is_empty() {
            return Vec::new();
        }
        let read = if self.big_endian { f64::from_be_bytes } else { f64::from_le_bytes };
        eights.iter().take(16).map(|&eight| read(eight)).collect()
    }
}
