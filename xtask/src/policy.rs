//! Licences, sources, bans and Rust versions of everything that the workspace depends on, as deny.toml wants them.
//!
//! `cargo deny check` reads the same file and also knows the advisories, which are on the network. This check needs
//! `cargo metadata` alone, so it runs wherever the workspace builds.

use std::collections::BTreeMap;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::licence::is_allowed;
use crate::workspace::root;

/// The only registry.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// What deny.toml demands.
struct Policy {
    /// Licences that suffice alone.
    licences: Vec<String>,
    /// Packages that may not be there.
    banned: Vec<String>,
}

/// Checks all dependencies, of every feature and platform.
///
/// # Errors
///
/// If one does not meet the policy, or cargo or deny.toml cannot be read.
pub fn run() -> Result<()> {
    let root = root()?;
    let arguments = ["metadata", "--format-version", "1", "--locked", "--all-features"];
    let output = Command::new("cargo").args(arguments).current_dir(root).output()?;
    ensure!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    let packages = metadata["packages"].as_array().context("metadata without packages")?;
    let policy = Policy::parse(&std::fs::read_to_string(root.join("deny.toml")).context("deny.toml")?)?;
    let problems = policy.problems(packages);
    for problem in &problems {
        println!("error:   {problem}");
    }
    for (name, versions) in several_versions(packages) {
        println!("warning: {name} is there in the versions {}", versions.join(", "));
    }
    ensure!(
        problems.is_empty(),
        "dependencies: {} do not meet deny.toml",
        problems.len()
    );
    println!(
        "dependencies: {} packages meet deny.toml; advisories are not checked here (cargo deny check advisories)",
        packages.len()
    );
    Ok(())
}

impl Policy {
    fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = text.parse().context("deny.toml")?;
        let list = |section: &str, key: &str| {
            table
                .get(section)
                .and_then(|section| section.get(key))
                .and_then(toml::Value::as_array)
                .with_context(|| format!("deny.toml has no list `{key}` in [{section}]"))
        };
        let licences = list("licenses", "allow")?;
        let banned = list("bans", "deny")?;
        Ok(Self {
            licences: licences
                .iter()
                .filter_map(toml::Value::as_str)
                .map(str::to_owned)
                .collect(),
            banned: banned
                .iter()
                .filter_map(|package| package.get("name").and_then(toml::Value::as_str))
                .map(str::to_owned)
                .collect(),
        })
    }

    /// What is wrong with the packages of `cargo metadata`.
    fn problems(&self, packages: &[Value]) -> Vec<String> {
        let ours = packages.iter().filter(|package| package["source"].is_null());
        let oldest = ours.clone().filter_map(rust_version).min();
        let mut problems = Vec::new();
        for package in packages {
            let name = format!("{} {}", text(package, "name"), text(package, "version"));
            if self.banned.iter().any(|banned| banned == text(package, "name")) {
                problems.push(format!("{name} is banned"));
            }
            if !is_allowed(text(package, "license"), &self.licences) {
                problems.push(format!("{name} is licensed as `{}`", text(package, "license")));
            }
            if package["source"].is_null() {
                continue;
            }
            if text(package, "source") != REGISTRY {
                problems.push(format!("{name} is from {}", text(package, "source")));
            }
            if let (Some(theirs), Some(oldest)) = (rust_version(package), oldest)
                && theirs > oldest
            {
                problems.push(format!(
                    "{name} needs Rust {}.{}, the workspace promises {}.{}",
                    theirs.0, theirs.1, oldest.0, oldest.1
                ));
            }
        }
        for package in ours {
            let dependencies = package["dependencies"].as_array().map_or(&[][..], Vec::as_slice);
            for dependency in dependencies {
                if text(dependency, "req") == "*" && dependency["path"].is_null() {
                    problems.push(format!(
                        "{} takes any version of {}",
                        text(package, "name"),
                        text(dependency, "name")
                    ));
                }
            }
        }
        problems
    }
}

/// Oldest Rust that a package promises to build with.
fn rust_version(package: &Value) -> Option<(u32, u32)> {
    let mut parts = package["rust_version"].as_str()?.split('.').map(str::parse);
    Some((parts.next()?.ok()?, parts.next()?.ok()?))
}

/// Packages that are there more than once, each compiled for itself.
fn several_versions(packages: &[Value]) -> BTreeMap<&str, Vec<&str>> {
    let mut versions: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for package in packages {
        versions
            .entry(text(package, "name"))
            .or_default()
            .push(text(package, "version"));
    }
    versions.retain(|_, versions| versions.len() > 1);
    versions
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::{Policy, REGISTRY, several_versions};
    use serde_json::{Value, json};

    fn package(changes: &Value) -> Value {
        let mut package = json!({
            "name": "a", "version": "1.0.0", "license": "MIT", "source": REGISTRY, "rust_version": "1.80", "dependencies": []
        });
        for (key, value) in changes.as_object().unwrap() {
            package[key] = value.clone();
        }
        package
    }

    fn problems(changes: &Value) -> Vec<String> {
        let policy = "[licenses]\nallow = [\"MIT\"]\n[bans]\ndeny = [{ name = \"cc\" }]\n";
        let ours = package(&json!({"name": "ours", "source": null, "rust_version": "1.90"}));
        Policy::parse(policy).unwrap().problems(&[ours, package(changes)])
    }

    #[test]
    fn each_demand_is_checked() {
        assert!(problems(&json!({})).is_empty());
        for (changes, what) in [
            (json!({"name": "cc"}), "banned"),
            (json!({"license": "GPL-3.0"}), "GPL-3.0"),
            (json!({"license": null}), "licensed"),
            (json!({"source": "git+https://example.org/a"}), "example.org"),
            (json!({"rust_version": "1.91"}), "needs Rust 1.91"),
            (
                json!({"source": null, "dependencies": [{"name": "b", "req": "*"}]}),
                "any version of b",
            ),
        ] {
            let found = problems(&changes);
            assert!(found.len() == 1 && found[0].contains(what), "{found:?}");
        }
    }

    #[test]
    fn a_policy_without_its_lists_is_refused() {
        assert!(Policy::parse("[licenses]\nallow = []\n").is_err());
    }

    #[test]
    fn packages_of_two_versions_are_named() {
        let twice = [package(&json!({})), package(&json!({"version": "2.0.0"}))];
        assert_eq!(several_versions(&twice)["a"], ["1.0.0", "2.0.0"]);
        assert!(several_versions(&twice[..1]).is_empty());
    }
}
