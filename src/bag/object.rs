//! Bags in object stores: reading and listing, or an error if the feature `remote` is disabled.

#[cfg(feature = "remote")]
pub(crate) use super::remote::{list, open, version};
#[cfg(not(feature = "remote"))]
pub(crate) use without::{list, open, version};

#[cfg(not(feature = "remote"))]
mod without {
    use crate::bag::input::public_url_of;
    use crate::bag::model::{OpenOptions, Reader};
    use crate::bag::unknown::elsewhere;
    use crate::base::error::Result;

    pub(crate) fn list(url: &str) -> Result<Vec<String>> {
        Err(elsewhere(&public_url_of(url)))
    }

    pub(crate) fn open(url: &str, _: &OpenOptions) -> Result<Box<dyn Reader>> {
        Err(elsewhere(&public_url_of(url)))
    }

    pub(crate) fn version(url: &str) -> Result<(u64, Option<String>)> {
        Err(elsewhere(&public_url_of(url)))
    }
}
