//! The stores behind URLs, and their errors; the only file that waits for futures.

use std::io;
use std::ops::Range;
use std::path::Path as FilePath;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use futures_util::StreamExt as _;
use futures_util::future::try_join_all;
use object_store::aws::AmazonS3Builder;
use object_store::azure::MicrosoftAzureBuilder;
use object_store::client::ClientOptions;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{
    BackoffConfig, Error as StoreError, GetOptions, GetRange, GetResult, ObjectMeta, ObjectStore,
    ObjectStoreExt as _, RetryConfig,
};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::Semaphore;
use url::Url;

use crate::base::error::Error;

/// A request that fails for a transient reason (429, 5xx, a broken connection) is retried this many times, within
/// [`RETRY_SECONDS`].
const RETRIES: usize = 5;
/// See [`RETRIES`].
const RETRY_SECONDS: u64 = 60;
/// The most concurrent requests of the process: each is an open connection, of which a process may have few.
const MOST_ASKED: usize = 128;
/// The most objects listed below one prefix.
const MOST_LISTED: usize = 1 << 20;

/// Why a store refused a request.
#[derive(Clone, Debug)]
pub(super) struct StoreRefusal {
    kind: io::ErrorKind,
    reason: String,
    hint: &'static str,
}

const CREDENTIALS: &str = "credentials come from the environment: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY (for a \
    public bucket AWS_SKIP_SIGNATURE=true), GOOGLE_APPLICATION_CREDENTIALS, AZURE_STORAGE_ACCOUNT_NAME and _KEY";
const AGAIN: &str = "try again; nothing of it was counted";

impl StoreRefusal {
    fn new(kind: io::ErrorKind, reason: impl Into<String>, hint: &'static str) -> Self {
        Self {
            kind,
            reason: reason.into(),
            hint,
        }
    }

    fn of(error: &StoreError) -> Self {
        match error {
            StoreError::NotFound { .. } => {
                Self::new(io::ErrorKind::NotFound, "there is no such object", "")
            }
            StoreError::PermissionDenied { .. } => Self::new(
                io::ErrorKind::PermissionDenied,
                "the store denies access (403)",
                CREDENTIALS,
            ),
            StoreError::Unauthenticated { .. } => Self::new(
                io::ErrorKind::PermissionDenied,
                "the store requires credentials (401)",
                CREDENTIALS,
            ),
            StoreError::Precondition { .. } => Self::replaced(),
            StoreError::NotSupported { .. } => Self::new(
                io::ErrorKind::Unsupported,
                "the server does not support range requests",
                "download the bag",
            ),
            other if is_instance(other) => Self::new(
                io::ErrorKind::PermissionDenied,
                "no credentials were found for it",
                CREDENTIALS,
            ),
            other => Self::new(io::ErrorKind::Other, innermost(other), AGAIN),
        }
    }

    fn replaced() -> Self {
        let what = "it was replaced while it was read";
        Self::new(io::ErrorKind::Other, what, AGAIN)
    }

    /// As the error of a bag.
    pub(super) fn error(&self, url: &str) -> Error {
        if self.kind == io::ErrorKind::NotFound {
            return Error::io("read", FilePath::new(url))(self.io());
        }
        Error::Remote {
            url: url.to_owned(),
            reason: self.reason.clone(),
            hint: self.hint.to_owned(),
        }
    }

    /// As the error of one reading.
    pub(super) fn io(&self) -> io::Error {
        io::Error::new(self.kind, self.reason.clone())
    }
}

/// Whether the cloud's instance metadata service, the last source of credentials tried, did not answer.
fn is_instance(error: &StoreError) -> bool {
    let text = error.to_string();
    let places = [
        "169.254.169.254",
        "169.254.170.2",
        "metadata.google.internal",
    ];
    places.iter().any(|place| text.contains(place))
}

/// The most characters of a server's answer that are reported.
const MOST_REASON: usize = 200;

/// The innermost cause of an error: outer ones may contain a URL with a signature.
fn innermost(error: &StoreError) -> String {
    let mut inner: &dyn std::error::Error = error;
    while let Some(deeper) = inner.source() {
        inner = deeper;
    }
    inner.to_string().chars().take(MOST_REASON).collect()
}

static ASKED: Semaphore = Semaphore::const_new(MOST_ASKED);

type StoreResult<T> = Result<T, StoreRefusal>;

/// Waits for an answer on separate threads: the caller may be inside another program's event loop.
fn wait<T: Send + 'static>(
    answer: impl Future<Output = StoreResult<T>> + Send + 'static,
) -> StoreResult<T> {
    let runtime = runtime()?;
    let (to, from) = std::sync::mpsc::sync_channel(1);
    runtime.spawn(async move { to.send(answer.await) });
    let given_up = |_| StoreRefusal::new(io::ErrorKind::Other, "it was cancelled", AGAIN);
    from.recv().map_err(given_up)?
}

/// The runtime for all requests: two threads, however many callers.
fn runtime() -> StoreResult<&'static Runtime> {
    static ONE: OnceLock<io::Result<Runtime>> = OnceLock::new();
    let made = ONE.get_or_init(|| {
        let mut builder = Builder::new_multi_thread();
        builder.worker_threads(2).enable_all().build()
    });
    let failed = |e: &io::Error| StoreRefusal::new(e.kind(), e.to_string(), "");
    made.as_ref().map_err(failed)
}

/// The store of `url`, and the path in it.
fn store(url: &str) -> StoreResult<(Arc<dyn ObjectStore>, Path)> {
    if url.starts_with("http") {
        return web(url);
    }
    let (scheme, rest) = url.split_once("://").unwrap_or(("", url));
    let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
    let root = format!("{scheme}://{bucket}");
    let made: Result<Arc<dyn ObjectStore>, StoreError> = match scheme {
        "s3" | "s3a" => {
            let builder = AmazonS3Builder::from_env().with_url(root);
            builder
                .with_retry(retry())
                .build()
                .map(|s| Arc::new(s) as _)
        }
        "gs" => {
            let builder = GoogleCloudStorageBuilder::from_env().with_url(root);
            builder
                .with_retry(retry())
                .build()
                .map(|s| Arc::new(s) as _)
        }
        _ => {
            let builder = MicrosoftAzureBuilder::from_env().with_url(root);
            builder
                .with_retry(retry())
                .build()
                .map(|s| Arc::new(s) as _)
        }
    };
    // The key verbatim: `%`, `?` and `#` have no meaning in it.
    let path = Path::parse(key).map_err(|e| bad_url(&e))?;
    Ok((made.map_err(|e| StoreRefusal::of(&e))?, path))
}

/// A web server; the query is sent too, as it may be a signature that grants access.
fn web(url: &str) -> StoreResult<(Arc<dyn ObjectStore>, Path)> {
    let parsed = Url::parse(url).map_err(|e| bad_url(&e))?;
    let path = Path::from_url_path(parsed.path()).map_err(|e| bad_url(&e))?;
    let mut root = parsed.clone();
    root.set_path("/");
    root.set_fragment(None);
    // HTTPS is never downgraded to HTTP.
    let options = ClientOptions::new().with_allow_http(parsed.scheme() == "http");
    let builder = HttpBuilder::new().with_url(root.as_str());
    let made = builder
        .with_client_options(options)
        .with_retry(retry())
        .build();
    Ok((Arc::new(made.map_err(|e| StoreRefusal::of(&e))?), path))
}

fn retry() -> RetryConfig {
    RetryConfig {
        backoff: BackoffConfig::default(),
        max_retries: RETRIES,
        retry_timeout: Duration::from_secs(RETRY_SECONDS),
    }
}

fn bad_url(why: &dyn std::fmt::Display) -> StoreRefusal {
    StoreRefusal::new(
        io::ErrorKind::InvalidInput,
        why.to_string(),
        "check the URL",
    )
}

/// One version of an object.
#[derive(Debug)]
pub(super) struct Object {
    store: Arc<dyn ObjectStore>,
    path: Path,
    pub(super) len: u64,
    pub(super) etag: Option<String>,
    meta: ObjectMeta,
}

impl Object {
    /// Opens the object at `url` and returns its first bytes, at most `first`.
    pub(super) fn open(url: &str, first: u64) -> StoreResult<(Self, Vec<u8>)> {
        let (store, path) = store(url)?;
        let (asked, at) = (Arc::clone(&store), path.clone());
        let (meta, bytes) = wait(async move { begin(&*asked, &at, first).await })?;
        if i64::try_from(meta.size).is_err() {
            let what = "the server reports more than 2^63 bytes";
            return Err(StoreRefusal::new(
                io::ErrorKind::InvalidData,
                what,
                "check the URL",
            ));
        }
        let object = Self {
            store,
            path,
            len: meta.size,
            etag: meta.e_tag.clone(),
            meta,
        };
        Ok((object, bytes))
    }

    /// Fetches these parts concurrently; each complete and of the opened version.
    pub(super) fn get(self: &Arc<Self>, ranges: &[Range<u64>]) -> StoreResult<Vec<Vec<u8>>> {
        let parts = ranges.iter().cloned().map(|range| {
            let object = Arc::clone(self);
            async move { object.part(range).await }
        });
        let parts: Vec<_> = parts.collect();
        wait(try_join_all(parts))
    }

    async fn part(&self, range: Range<u64>) -> StoreResult<Vec<u8>> {
        // The semaphore is never closed.
        let _turn = ASKED.acquire().await;
        let is_strong = |etag: &&String| !etag.starts_with("W/");
        let is_dated = self.etag.is_none() && self.meta.last_modified.timestamp() > 0;
        let options = GetOptions {
            range: Some(GetRange::Bounded(range.clone())),
            if_match: self.etag.as_ref().filter(is_strong).cloned(),
            if_unmodified_since: is_dated.then_some(self.meta.last_modified),
            ..GetOptions::default()
        };
        let got = self.store.get_opts(&self.path, options).await;
        let got = got.map_err(|e| StoreRefusal::of(&e))?;
        if !self.is_version(&got.meta) {
            return Err(StoreRefusal::replaced());
        }
        taken(got, range.end - range.start).await
    }

    /// Checks the version: servers without `If-Match` return a new version and its tag.
    fn is_version(&self, meta: &ObjectMeta) -> bool {
        let is_dated = meta.last_modified == self.meta.last_modified;
        meta.size == self.len && meta.e_tag == self.etag && is_dated
    }
}

/// The first bytes of an object, at most `first`, and its metadata.
async fn begin(
    store: &dyn ObjectStore,
    path: &Path,
    first: u64,
) -> StoreResult<(ObjectMeta, Vec<u8>)> {
    let options = GetOptions {
        range: Some(GetRange::Bounded(0..first)),
        ..GetOptions::default()
    };
    match store.get_opts(path, options).await {
        Ok(got) => {
            let (meta, len) = (got.meta.clone(), got.range.end - got.range.start);
            Ok((meta, taken(got, len).await?))
        }
        // An empty object has no first bytes to request.
        Err(error @ (StoreError::Generic { .. } | StoreError::NotSupported { .. })) => {
            let meta = store.head(path).await.ok().filter(|meta| meta.size == 0);
            let meta = meta.ok_or_else(|| StoreRefusal::of(&error))?;
            Ok((meta, Vec::new()))
        }
        Err(error) => Err(StoreRefusal::of(&error)),
    }
}

/// The first `len` bytes of an answer, however much the server sends.
async fn taken(got: GetResult, len: u64) -> StoreResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut stream = got.into_stream();
    while let Some(some) = stream.next().await {
        bytes.extend_from_slice(&some.map_err(|e| StoreRefusal::of(&e))?);
        if bytes.len() as u64 >= len {
            break;
        }
    }
    if bytes.len() as u64 == len {
        return Ok(bytes);
    }
    let what = "a response had the wrong length";
    Err(StoreRefusal::new(io::ErrorKind::UnexpectedEof, what, AGAIN))
}

/// Every object below the prefix `url`, which ends in a slash; sorted by URL.
///
/// # Errors
/// [`Error::Remote`] if the store fails.
pub(crate) fn list(url: &str) -> Result<Vec<String>, Error> {
    let mut all = listed(url).map_err(|why| why.error(url))?;
    all.sort();
    Ok(all)
}

fn listed(url: &str) -> StoreResult<Vec<String>> {
    if url.starts_with("http") {
        let what = "a web server does not list its files";
        let hint = "give the bags, or a list of them with `--manifest`";
        return Err(StoreRefusal::new(io::ErrorKind::Unsupported, what, hint));
    }
    let (store, prefix) = store(url)?;
    let root = url.strip_suffix(&format!("{prefix}/")).unwrap_or(url);
    let root = root.trim_end_matches('/').to_owned();
    wait(async move {
        let mut all = Vec::new();
        let mut found = store.list(Some(&prefix));
        while let Some(object) = found.next().await {
            let object = object.map_err(|e| StoreRefusal::of(&e))?;
            all.push(format!("{root}/{}", object.location));
            if all.len() > MOST_LISTED {
                let what = "it contains more than a million objects";
                let hint = "give a list of them with `--manifest`";
                return Err(StoreRefusal::new(io::ErrorKind::Other, what, hint));
            }
        }
        Ok(all)
    })
}
