//! Commands in the fenced blocks and the code spans of a document.

/// A command of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Example {
    /// Path of the document, from the root of the repository.
    pub(crate) document: String,
    /// Line of the command.
    pub(crate) line: usize,
    /// Number of its block in the document; none: it is in a sentence.
    pub(crate) block: Option<usize>,
    /// The command, without prompt and comment, continued lines in one.
    pub(crate) text: String,
}

impl std::fmt::Display for Example {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {}", self.document, self.line, self.text)
    }
}

/// Commands of the shell blocks of a document: of `sh` blocks every line, of `console` blocks those behind a prompt.
pub(crate) fn in_blocks(document: &str, text: &str) -> Vec<Example> {
    let mut found: Vec<Example> = Vec::new();
    let mut fence: Option<&str> = None;
    let mut continues = false;
    let mut block = 0;
    for (index, line) in text.lines().enumerate() {
        if let Some(word) = line.strip_prefix("```") {
            block += usize::from(fence.is_none());
            fence = if fence.is_some() { None } else { Some(word) };
            continues = false;
            continue;
        }
        let shown = match fence {
            Some("sh" | "bash") => Some(line),
            Some("console") if continues => Some(line),
            Some("console") => line.strip_prefix("$ "),
            _ => None,
        };
        let Some(shown) = shown else { continue };
        let (command, goes_on) = match without_comment(shown).strip_suffix('\\') {
            Some(begun) => (begun.trim().to_owned(), true),
            None => (without_comment(shown).to_owned(), false),
        };
        if continues {
            if let Some(last) = found.last_mut() {
                last.text = format!("{} {command}", last.text);
            }
        } else if !command.is_empty() {
            found.push(Example {
                document: document.to_owned(),
                line: index + 1,
                block: Some(block),
                text: command,
            });
        }
        continues = goes_on;
    }
    found
}

/// Commands of this program in code spans outside of blocks.
pub(crate) fn in_sentences(document: &str, text: &str) -> Vec<Example> {
    let mut found = Vec::new();
    let mut is_block = false;
    let mut offset = 0;
    let mut prose = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let is_fence = line.starts_with("```");
        // A span may go over the end of a line, but not out of its paragraph.
        let blank = "\n".len();
        if is_fence || is_block {
            prose.push_str(&" ".repeat(line.len() - blank.min(line.len())));
            prose.push_str(if line.ends_with('\n') { "\n" } else { "" });
        } else {
            prose.push_str(line);
        }
        is_block ^= is_fence;
        offset += line.len();
    }
    assert_eq!(offset, text.len());
    let mut from = 0;
    while let Some(at) = prose.get(from..).and_then(|rest| rest.find('`')) {
        let begin = from + at + 1;
        let Some(length) = prose.get(begin..).and_then(|rest| rest.find('`')) else { break };
        let span = &prose[begin..begin + length];
        let command = span.split_whitespace().collect::<Vec<_>>().join(" ");
        if command.starts_with("updraft ") && !span.contains("\n\n") {
            found.push(Example {
                document: document.to_owned(),
                line: prose[..begin].lines().count(),
                block: None,
                text: command,
            });
        }
        from = begin + length + 1;
    }
    found
}

/// A line of a shell without the comment at its end.
pub(crate) fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            None if c == '#' && before.is_whitespace() => return line[..at].trim(),
            None if c == '\'' || c == '"' => quote = Some(c),
            Some(_) | None => {}
        }
        before = c;
    }
    line.trim()
}

/// Words of a command line; quotes are taken away.
pub(crate) fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut word: Option<String> = None;
    let mut quote = None;
    for c in text.chars() {
        match quote {
            Some(open) if c == open => quote = None,
            None if c == '\'' || c == '"' => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            None if c.is_whitespace() => words.extend(word.take()),
            Some(_) | None => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

#[test]
fn commands_are_found_without_prompts_and_comments() {
    let text = "```sh\nupdraft a '# b' # c\nupdraft d \\\n    --e\n\n# only words\n```\n\n```console\n$ updraft f\nFlew it\n```\n`updraft\ng` and `h`\n";
    let found: Vec<_> =
        in_blocks("x.md", text).into_iter().map(|one| (one.line, one.text)).collect();
    let wanted = [(2, "updraft a '# b'"), (3, "updraft d --e"), (10, "updraft f")];
    assert_eq!(found, wanted.map(|(line, text)| (line, text.to_owned())));
    let spans: Vec<_> =
        in_sentences("x.md", text).into_iter().map(|one| (one.line, one.text)).collect();
    assert_eq!(spans, [(13, "updraft g".to_owned())]);
    assert_eq!(words("a 'b c'd \"\""), ["a", "b cd", ""]);
}
