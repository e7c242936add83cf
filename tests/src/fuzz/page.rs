//! What pages send.

/// Bytes as a request, and as the messages of a page. Whatever they are, they are heard, refused, or drawn. Says whether they are a
/// request, and whether a look.
pub fn page(bytes: &[u8]) -> [bool; 2] {
    atoll::internals::overhear(bytes)
}
