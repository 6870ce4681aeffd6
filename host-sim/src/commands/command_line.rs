//! Command lines that give the same results again, for reports.

/// Command line of this process, with the `seed` that it drew from. It has no `left_out` options, which do not change
/// results and take a value, and none that says how results are told.
pub fn of_this_process(command: &str, left_out: &[&str], seed: Option<u64>) -> String {
    let given: Vec<String> =
        std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    repeated(&given, command, left_out, seed)
}

/// Options that change what is said, and no result.
const TOLD: [&str; 6] = ["--json", "--all", "-q", "--quiet", "-v", "--verbose"];

fn repeated(given: &[String], command: &str, left_out: &[&str], seed: Option<u64>) -> String {
    let mut words = vec!["taxel".to_owned()];
    // Without a command there is a default one.
    if !given.iter().any(|word| word == command) {
        words.push(command.into());
    }
    let mut given = given.iter();
    while let Some(word) = given.next() {
        let joined = |option: &&str| {
            let value = word.strip_prefix(*option);
            value.is_some_and(|value| value.starts_with('=') || !option.starts_with("--"))
        };
        if left_out.contains(&word.as_str()) {
            given.next();
        } else if !TOLD.contains(&word.as_str()) && !left_out.iter().any(joined) {
            words.push(quoted(word));
        }
    }
    let has_seed = words.iter().any(|word| word == "--seed" || word.starts_with("--seed="));
    if let (Some(seed), false) = (seed, has_seed) {
        words.push(format!("--seed {seed}"));
    }
    words.join(" ")
}

/// Word of a command line, in quotes where a shell needs them.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+".contains(c);
    if word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::repeated;

    fn of_run(words: &[&str]) -> String {
        let given: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        repeated(&given, "run", &["-o", "--output"], Some(7))
    }

    #[test]
    fn the_same_results_have_the_same_command_line() {
        let plain = "taxel run press --noise 0.01 --seed 7";
        for words in [
            &["run", "press", "--noise", "0.01"][..],
            &["run", "press", "--noise", "0.01", "-o", "there"],
            &["run", "press", "-othere", "--noise", "0.01", "--json", "-q"],
            &["run", "press", "--output=there", "--noise", "0.01", "--seed", "7"],
        ] {
            assert_eq!(of_run(words), plain);
        }
        assert_eq!(of_run(&[]), "taxel run --seed 7");
        assert_eq!(of_run(&["run", "my scene.toml"]), "taxel run 'my scene.toml' --seed 7");
    }
}
