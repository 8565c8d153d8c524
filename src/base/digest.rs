//! SHA-256 hashes of bytes as hexadecimal text.

use sha2::{Digest as _, Sha256};

/// SHA-256 of bytes, in lower-case hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

/// Result of a SHA-256, in lower-case hexadecimal.
pub fn hexadecimal(hash: Sha256) -> String {
    base16ct::lower::encode_string(&hash.finalize())
}

/// SHA-256 of a set of files by their own hashes, whatever their names and their order.
pub fn sha256_of_files<'a>(hashes: impl IntoIterator<Item = &'a str>) -> String {
    let mut hashes: Vec<&str> = hashes.into_iter().collect();
    hashes.sort_unstable();
    sha256(hashes.join("\n").as_bytes())
}

/// SHA-256 of the lines `HASH  PATH` of files (path, hash) by path, as `sha256sum` writes them.
pub fn sha256_of_list<'a>(files: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let mut files: Vec<(&str, &str)> = files.into_iter().collect();
    files.sort_unstable();
    let lines: Vec<String> = files.iter().map(|(path, hash)| format!("{hash}  {path}\n")).collect();
    sha256(lines.concat().as_bytes())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_hash_is_the_standards() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(
            super::sha256(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }

    #[test]
    fn the_hash_of_a_list_is_that_of_sha256sums() {
        let files = [("b/2.BIN", "22"), ("a/1.BIN", "11")];
        assert_eq!(super::sha256_of_list(files), super::sha256(b"11  a/1.BIN\n22  b/2.BIN\n"));
    }
}
