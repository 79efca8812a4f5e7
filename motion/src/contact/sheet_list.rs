//! A list that grows while members of the list are lent out.

use snaprod_systems::rod::contact::TouchedSheet;
use std::sync::OnceLock;

/// Sheets of a rod with touches. A sheet stays in its place for as long as the list lives.
#[derive(Default)]
pub(crate) struct SheetList {
    first: OnceLock<Box<Link>>,
}

struct Link {
    sheet: TouchedSheet,
    rest: SheetList,
}

impl SheetList {
    /// Adds a sheet at the end of the list.
    pub fn add(&self, sheet: TouchedSheet) -> &TouchedSheet {
        let (mut list, mut given) = (self, Some(sheet));
        loop {
            let link = list.first.get_or_init(|| {
                let sheet = given.take().expect("a sheet is added once");
                Box::new(Link {
                    sheet,
                    rest: Self::default(),
                })
            });
            if given.is_none() {
                return &link.sheet;
            }
            list = &link.rest;
        }
    }
}

/// A copy of the obstacles has no sheets yet.
impl Clone for SheetList {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Link by link: a long list must not fill the stack.
impl Drop for SheetList {
    fn drop(&mut self) {
        let mut next = self.first.take();
        while let Some(mut link) = next {
            next = link.rest.first.take();
        }
    }
}
