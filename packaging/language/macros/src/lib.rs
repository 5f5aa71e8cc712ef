//! The macro that makes a sentence in the language of the program.

use proc_macro::TokenStream;
use proc_macro2::{Ident, Span, TokenStream as Tokens};
use quote::quote;
use syn::parse::{Parse, ParseStream};
use syn::punctuated::Punctuated;
use syn::{Expr, LitStr, Token, parse_macro_input};

/// A sentence, written as for [`format!`]: in English as it stands, in another language by that language's table.
#[proc_macro]
pub fn say(input: TokenStream) -> TokenStream {
    let as_written = Tokens::from(input.clone());
    let sentence = parse_macro_input!(input as Sentence);
    let template = &sentence.template;
    let text = template.value();
    let (mut names, mut values) = (Vec::new(), Vec::new());
    // no name of the sentence
    let held = Ident::new("held", Span::mixed_site());
    let mut next = 0;
    for placeholder in placeholders(&text) {
        let (name, specification) = match placeholder.split_once(':') {
            Some((name, specification)) => (name, format!(":{specification}")),
            None => (placeholder, String::new()),
        };
        let index = match name.is_empty() {
            true => Some(next),
            false => name.parse().ok(),
        };
        next += usize::from(name.is_empty());
        let value = match index {
            Some(index) => {
                let Some(argument) = sentence.arguments.iter().nth(index) else {
                    let text = format!("no argument for the placeholder {index}");
                    return syn::Error::new(template.span(), text)
                        .to_compile_error()
                        .into();
                };
                names.push(index.to_string());
                quote!(#argument)
            }
            // a named argument, or a name in scope
            None => {
                names.push(name.to_owned());
                let in_scope = Ident::new(name, template.span());
                (sentence.named(name)).map_or(quote!(#in_scope), |named| quote!(#named))
            }
        };
        let one = LitStr::new(&format!("{{{specification}}}"), template.span());
        values.push(quote!({
            #[allow(unused_imports)]
            use ::tipwatch_language::{OfAny as _, OfNumber as _};
            match &(#value) {
                #held => ::tipwatch_language::Value(#held).said(::std::format!(#one, #held)),
            }
        }));
    }
    quote! {
        if ::tipwatch_language::is_english() {
            ::std::format!(#as_written)
        } else {
            ::tipwatch_language::filled(#template, &[#((#names, #values)),*])
        }
    }
    .into()
}

/// A template and its arguments.
struct Sentence {
    template: LitStr,
    arguments: Punctuated<Expr, Token![,]>,
}

impl Sentence {
    /// The value of the argument `name = value`.
    fn named(&self, name: &str) -> Option<&Expr> {
        self.arguments.iter().find_map(|argument| match argument {
            Expr::Assign(assigned) => match assigned.left.as_ref() {
                Expr::Path(path) if path.path.is_ident(name) => Some(assigned.right.as_ref()),
                _ => None,
            },
            _ => None,
        })
    }
}

impl Parse for Sentence {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let template = input.parse()?;
        if !input.is_empty() {
            input.parse::<Token![,]>()?;
        }
        let arguments = Punctuated::parse_terminated(input)?;
        Ok(Self {
            template,
            arguments,
        })
    }
}

/// Returns the text between the braces of each placeholder of a template, in order.
fn placeholders(template: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = template;
    while let Some(at) = rest.find(['{', '}']) {
        let after = &rest[at + 1..];
        let doubled = after.starts_with(&rest[at..=at]);
        match after.find('}') {
            _ if doubled => rest = &after[1..],
            Some(end) if rest[at..].starts_with('{') => {
                found.push(&after[..end]);
                rest = &after[end + 1..];
            }
            _ => rest = after,
        }
    }
    found
}
