//! What `cargo package` packs: all that building needs, and all that the README shows.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Files of the package, as cargo lists them.
fn packed() -> BTreeSet<String> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let listed = Command::new(cargo)
        .args(["package", "--list", "--allow-dirty", "--offline", "--package", "updraft"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
    String::from_utf8(listed.stdout).unwrap().lines().map(str::to_owned).collect()
}

/// Targets of the links and images of a page that are files of the repository.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://")).collect()
}

#[test]
fn the_package_has_what_the_readme_shows_and_the_sources_embed() {
    let packed = packed();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let links = links(&readme);
    assert!(links.len() > 20 && links.contains(&"docs/images/report.png"), "{links:?}");
    for link in links {
        // The crates of the workspace are packages of their own.
        let folder = format!("{}/", link.trim_end_matches('/'));
        let has = packed.contains(link) || packed.iter().any(|file| file.starts_with(&folder));
        assert!(has || link == "crates", "the README shows {link}, and the package has it not");
    }
    for file in packed
        .iter()
        .filter(|file| file.starts_with("src/") && file.rsplit('.').next() == Some("rs"))
    {
        let text = std::fs::read_to_string(root.join(file)).unwrap();
        for embedded in
            text.split("include_str!(\"").skip(1).filter_map(|rest| rest.split('"').next())
        {
            let name = embedded.trim_start_matches("../");
            let own = Path::new(file).parent().unwrap().join(embedded);
            let has = packed.contains(name) || packed.contains(own.to_str().unwrap());
            assert!(has, "{file} embeds {embedded}");
        }
    }
    // Tests need the whole repository: what is packed tests nothing that is missing.
    assert!(!packed.iter().any(|file| file.starts_with("tests/")), "tests are packed");
}
