//! What SPIR-V does not keep of a GLSL file: comments, line numbers, includes and constants.
//!
//! Layout, access and types are never read from here: SPIR-V says those.

use std::collections::HashMap;

/// A declaration in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declaration {
    /// Line of the declared name, counted from 1.
    pub line: u32,
    /// The comment at the end of its line, else the comment lines directly above it; may be empty.
    pub doc: String,
}

/// A top-level `const` scalar with a literal value.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Value,
    /// Where it is and what its comment says.
    pub declaration: Declaration,
}

/// The value of a [`Constant`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// `const uint`.
    Uint(u32),
    /// `const int`.
    Int(i32),
    /// `const float`, rounded as glslang rounds: to double, then to single precision.
    Float(f32),
}

/// A top-level `layout(constant_id = N) const bool`: an effect that a frame may call for.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Its name.
    pub name: String,
    /// Its number.
    pub number: u32,
    /// Where it is and what its comment says.
    pub declaration: Declaration,
}

/// The text of one GLSL file, taken apart.
#[derive(Debug, Default)]
pub struct Source {
    /// The comment lines at the head of the file.
    pub heading: String,
    /// The quoted includes.
    pub includes: Vec<(String, u32)>,
    /// Variables, blocks (by block and by instance name) and structs.
    pub declarations: HashMap<String, Declaration>,
    /// Members of blocks and structs, by block or struct and member name.
    pub members: HashMap<(String, String), Declaration>,
    /// The constants, in order.
    pub constants: Vec<Constant>,
    /// The effects, in order.
    pub effects: Vec<Effect>,
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    Number(String),
    Mark(char),
}

/// Tokens with their lines, and what stands beside them.
#[derive(Default)]
struct Lexed {
    tokens: Vec<(Token, u32)>,
    /// Line to comment, and whether the comment has the line to itself.
    comments: HashMap<u32, (String, bool)>,
    includes: Vec<(String, u32)>,
}

impl Source {
    /// Takes a file apart. Text that is not GLSL gives no declarations rather than an error: glslang complains better.
    pub fn parse(text: &str) -> Self {
        let lexed = lex(text);
        let mut source = Self { heading: heading(text), includes: lexed.includes.clone(), ..Self::default() };
        let mut at = 0;
        while at < lexed.tokens.len() {
            at = source.statement(&lexed, at);
        }
        source
    }

    /// Reads one top-level statement from token `at` and returns where the next begins.
    fn statement(&mut self, lexed: &Lexed, at: usize) -> usize {
        let tokens = &lexed.tokens;
        let end = (at..tokens.len()).find(|&i| matches!(tokens[i].0, Token::Mark(';' | '{'))).unwrap_or(tokens.len());
        let head = &tokens[at..end];
        let declares = |words: &[&str]| head.iter().any(|(t, _)| matches!(t, Token::Word(w) if words.contains(&&**w)));
        if end == tokens.len() {
            return end;
        }
        if tokens[end].0 == Token::Mark(';') {
            if let Some(constant) = constant(lexed, head) {
                self.constants.push(constant);
            } else if let Some(effect) = effect(lexed, head) {
                self.effects.push(effect);
            } else if declares(&["uniform", "buffer", "in", "out"])
                && let Some((name, line)) = last_word(head)
            {
                let declaration = declaration(lexed, line, head[0].1);
                self.declarations.insert(name, declaration);
            }
            return end + 1;
        }
        let close = closing(tokens, end);
        if !declares(&["uniform", "buffer", "struct", "in", "out"]) || declares_function(head) {
            return close + 1;
        }
        let Some((block, line)) = last_word(head) else { return close + 1 };
        let declaration = declaration(lexed, line, head[0].1);
        self.block_members(lexed, &block, end + 1, close);
        let after = (close..tokens.len()).find(|&i| tokens[i].0 == Token::Mark(';')).unwrap_or(tokens.len());
        if let Some((instance, _)) = last_word(&tokens[close.min(after)..after]) {
            self.declarations.insert(instance, declaration.clone());
        }
        self.declarations.insert(block, declaration);
        after + 1
    }

    /// Reads the members of a block between two tokens.
    fn block_members(&mut self, lexed: &Lexed, block: &str, from: usize, to: usize) {
        let mut start = from;
        for i in from..to {
            if matches!(lexed.tokens[i].0, Token::Mark(';' | ',')) {
                if let Some((member, line)) = last_word(&lexed.tokens[start..i]) {
                    let declaration = declaration(lexed, line, lexed.tokens[start].1);
                    self.members.insert((block.to_owned(), member), declaration);
                }
                start = i + 1;
            }
        }
    }
}

/// The comment lines a file begins with, before or after `#version` and the like.
fn heading(text: &str) -> String {
    let mut lines = text.lines().map(str::trim).skip_while(|line| line.is_empty() || line.starts_with('#')).peekable();
    let mut heading = Vec::new();
    while let Some(comment) = lines.peek().and_then(|line| line.strip_prefix("//")) {
        heading.push(comment.trim().to_owned());
        lines.next();
    }
    heading.join("\n").trim().to_owned()
}

fn lex(text: &str) -> Lexed {
    let mut lexed = Lexed::default();
    let mut in_comment = false;
    let mut in_directive = false;
    for (number, line) in (1..).zip(text.lines()) {
        let first_token = lexed.tokens.len();
        let directive = in_directive || (!in_comment && line.trim_start().starts_with('#'));
        in_directive = directive && line.ends_with('\\');
        if let Some(path) = include(line).filter(|_| directive) {
            lexed.includes.push((path.to_owned(), number));
        }
        let mut rest = line;
        while let Some(c) = rest.chars().next() {
            if in_comment {
                in_comment = !rest.contains("*/");
                rest = rest.split_once("*/").map_or("", |(_, after)| after);
            } else if let Some(comment) = rest.strip_prefix("//") {
                let alone = !directive && lexed.tokens.len() == first_token;
                lexed.comments.insert(number, (comment.trim().to_owned(), alone));
                rest = "";
            } else if let Some(after) = rest.strip_prefix("/*") {
                in_comment = true;
                rest = after;
            } else if directive || c.is_whitespace() {
                rest = &rest[c.len_utf8()..];
            } else {
                let (token, after) = token(rest, c);
                lexed.tokens.push((token, number));
                rest = after;
            }
        }
    }
    lexed
}

/// Splits the first token off a text that begins with `first`.
fn token(text: &str, first: char) -> (Token, &str) {
    let second_is_digit = text[first.len_utf8()..].starts_with(|c: char| c.is_ascii_digit());
    if first.is_ascii_digit() || (first == '.' && second_is_digit) {
        let hexadecimal = text.starts_with("0x") || text.starts_with("0X");
        let mut previous = first;
        let end = text.find(|c: char| {
            let exponent_sign = !hexadecimal && matches!(c, '+' | '-') && matches!(previous, 'e' | 'E');
            previous = c;
            !(c.is_ascii_alphanumeric() || c == '.' || exponent_sign)
        });
        let (number, rest) = text.split_at(end.unwrap_or(text.len()));
        (Token::Number(number.to_owned()), rest)
    } else if first.is_ascii_alphabetic() || first == '_' {
        let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        (Token::Word(word.to_owned()), rest)
    } else {
        (Token::Mark(first), &text[first.len_utf8()..])
    }
}

/// The path of a line `#include "path"`.
fn include(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?;
    rest.trim_start().strip_prefix('"')?.split_once('"').map(|(path, _)| path)
}

/// The last word of a declaration that is neither in brackets nor in parentheses: the declared name.
fn last_word(tokens: &[(Token, u32)]) -> Option<(String, u32)> {
    let mut depth = 0;
    let mut last = None;
    for (token, line) in tokens {
        match token {
            Token::Mark('[' | '(') => depth += 1,
            Token::Mark(']' | ')') => depth -= 1,
            Token::Word(word) if depth == 0 => last = Some((word.clone(), *line)),
            _ => {}
        }
    }
    last
}

/// Whether the head of a braced statement is a function's: a name and its parameters before the brace.
fn declares_function(head: &[(Token, u32)]) -> bool {
    matches!(head.last(), Some((Token::Mark(')'), _)))
}

/// Index of the brace that closes the one at `open`.
fn closing(tokens: &[(Token, u32)], open: usize) -> usize {
    let mut depth = 0;
    for (i, (token, _)) in tokens.iter().enumerate().skip(open) {
        match token {
            Token::Mark('{') => depth += 1,
            Token::Mark('}') => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i;
        }
    }
    tokens.len()
}

/// The comment of a declaration whose name is on `line` and which begins on `first`.
fn declaration(lexed: &Lexed, line: u32, first: u32) -> Declaration {
    let trailing = |line| lexed.comments.get(&line).filter(|(_, alone)| !alone).map(|(text, _)| text.clone());
    let above = || {
        let mut lines = Vec::new();
        let mut line = first - 1;
        while let Some((text, true)) = lexed.comments.get(&line) {
            lines.insert(0, text.as_str());
            line -= 1;
        }
        // A comment that reaches up to the first line is the file's heading, not this declaration's.
        if line == 0 { String::new() } else { lines.join("\n") }
    };
    let doc = trailing(line).or_else(|| trailing(first)).unwrap_or_else(above);
    Declaration { line, doc }
}

/// Reads `const uint|int|float NAME = literal`.
fn constant(lexed: &Lexed, head: &[(Token, u32)]) -> Option<Constant> {
    let [
        (Token::Word(qualifier), first),
        (Token::Word(ty), _),
        (Token::Word(name), line),
        (Token::Mark('='), _),
        literal @ ..,
    ] = head
    else {
        return None;
    };
    let (sign, number) = match literal {
        [(Token::Number(number), _)] => ("", number),
        [(Token::Mark('-'), _), (Token::Number(number), _)] => ("-", number),
        _ => return None,
    };
    let value = match (qualifier.as_str(), ty.as_str()) {
        ("const", "uint") if sign.is_empty() => Value::Uint(u32::try_from(integer(number)?).ok()?),
        ("const", "int") => {
            let magnitude = integer(number)?;
            Value::Int(i32::try_from(if sign.is_empty() { magnitude } else { -magnitude }).ok()?)
        }
        ("const", "float") => {
            let digits = number.trim_end_matches(['f', 'F']);
            let value: f64 = format!("{sign}{digits}").parse().ok()?;
            #[expect(clippy::cast_possible_truncation, reason = "rounding to single precision is what is wanted")]
            Value::Float(value as f32)
        }
        _ => return None,
    };
    Some(Constant { name: name.clone(), value, declaration: declaration(lexed, *line, *first) })
}

/// Reads `layout(constant_id = N) const bool NAME = ...`.
fn effect(lexed: &Lexed, head: &[(Token, u32)]) -> Option<Effect> {
    let words: Vec<&str> = head
        .iter()
        .map(|(token, _)| match token {
            Token::Word(word) | Token::Number(word) => word.as_str(),
            Token::Mark(_) => "",
        })
        .collect();
    let ["layout", "", "constant_id", "", number, "", "const", "bool", name, "", ..] = words[..] else { return None };
    let declaration = declaration(lexed, head[8].1, head[0].1);
    Some(Effect { name: name.to_owned(), number: u32::try_from(integer(number)?).ok()?, declaration })
}

fn integer(number: &str) -> Option<i64> {
    let digits = number.trim_end_matches(['u', 'U']);
    if let Some(hexadecimal) = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        i64::from_str_radix(hexadecimal, 16).ok()
    } else if digits.len() > 1 && digits.starts_with('0') {
        i64::from_str_radix(digits, 8).ok()
    } else {
        digits.parse().ok()
    }
}
