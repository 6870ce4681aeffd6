//! Who may ask: a page of this machine that knows the token.
//!
//! A browser sends requests to 127.0.0.1 for any page that it shows. Three checks keep other pages out: `Host` (a foreign name that
//! resolves to 127.0.0.1), `Origin` (a foreign page), and the token (whoever else may connect).

use subtle::ConstantTimeEq;

use crate::http::{Head, Refusal};

/// Names of this machine. Any port is right: a tunnel (`ssh -L`) has its own.
const NAMES: [&str; 3] = ["127.0.0.1", "localhost", "[::1]"];
/// Fewest characters of a token.
const FEWEST_CHARACTERS: usize = 16;

/// A token that nobody can guess: 128 random bits.
pub fn random_token() -> std::io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
    Ok(format!("{:032x}", u128::from_ne_bytes(bytes)))
}

/// Whether `token` is long enough, and stands in an address and a page as it is.
pub fn is_token(token: &str) -> bool {
    token.len() >= FEWEST_CHARACTERS && token.bytes().all(|byte| byte.is_ascii_alphanumeric())
}

/// Refuses a request that comes from elsewhere or has another token.
pub fn check(head: &Head, token: &str) -> Result<(), Refusal> {
    if !is_local(&head.host) {
        return Err(Refusal::new(403, "this address is only for 127.0.0.1 and localhost"));
    }
    let is_foreign = |origin: &str| !origin.strip_prefix("http://").is_some_and(is_local);
    if head.origin.as_deref().is_some_and(is_foreign) {
        return Err(Refusal::new(403, "requests from other pages are refused"));
    }
    let given = head.parameter("token").unwrap_or_default();
    if !bool::from(given.as_bytes().ct_eq(token.as_bytes())) {
        return Err(Refusal::new(403, "wrong token: open the address that the program printed"));
    }
    Ok(())
}

/// Whether `authority` is a name of this machine, with or without a port.
fn is_local(authority: &str) -> bool {
    NAMES.iter().any(|name| match authority.strip_prefix(name) {
        Some("") => true,
        Some(rest) => rest.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok()),
        None => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_this_machine_are_local() {
        for authority in ["127.0.0.1", "127.0.0.1:80", "localhost:8471", "[::1]:9", "[::1]"] {
            assert!(is_local(authority), "{authority}");
        }
        for authority in [
            "",
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example:80",
            "127.0.0.1:",
            "127.0.0.1:99999",
            "127.0.0.1:80@evil.example",
            "evil.example:127.0.0.1",
            "127.0.0.2",
            "0.0.0.0",
        ] {
            assert!(!is_local(authority), "{authority}");
        }
    }

    #[test]
    fn random_tokens_are_tokens_and_differ() {
        let (one, other) = (random_token().expect("random"), random_token().expect("random"));
        assert!(is_token(&one) && is_token(&other) && one != other);
        assert!(!is_token("short") && !is_token("\"></script><script>alert(1)"));
    }
}
