//! Blocks of a document, read from the markup of the page.

use roxmltree::Node;

/// Most small pictures side by side.
const MOST_BESIDE: usize = 3;

/// A part of the document.
#[derive(Debug)]
pub(super) enum Block<'a> {
    /// A heading: its level, 2 or 3.
    Heading(u8, String),
    Paragraph(String),
    /// An entry of a list: how deep, and its text.
    Item(usize, String),
    Table(Table),
    /// Pictures side by side: each an SVG element and its caption; on the first page they are small.
    Pictures {
        pictures: Vec<(Node<'a, 'a>, String)>,
        small: bool,
    },
    /// Parts side by side.
    Columns(Vec<Vec<Block<'a>>>),
    /// Blocks on a sheet of their own.
    Sheet(Vec<Block<'a>>),
}

/// The cells of a table.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
    /// Whether the first cell of a row is the name of the row.
    pub(super) names_rows: bool,
}

/// The parts of an element, in order. What only a screen shows is left out.
pub(super) fn of<'a>(root: Node<'a, 'a>) -> Vec<Block<'a>> {
    let mut blocks = Vec::new();
    for child in root.children().filter(Node::is_element) {
        add(child, 0, &mut blocks);
    }
    blocks
}

fn has_class(node: Node<'_, '_>, class: &str) -> bool {
    let classes = node.attribute("class").unwrap_or_default();
    classes.split_whitespace().any(|name| name == class)
}

fn add<'a>(node: Node<'a, 'a>, depth: usize, blocks: &mut Vec<Block<'a>>) {
    if has_class(node, "screen") || has_class(node, "plot") {
        return;
    }
    match node.tag_name().name() {
        "h2" => blocks.push(Block::Heading(2, text(node))),
        "h3" => blocks.push(Block::Heading(3, text(node))),
        // the head of a list that folds on the page; that of a part is a heading of its own
        "summary" if !node.children().any(|child| child.has_tag_name("h2")) => {
            blocks.push(Block::Heading(3, text(node)));
        }
        "p" => blocks.push(Block::Paragraph(text(node))),
        "ul" => {
            for item in node.children().filter(Node::is_element) {
                let inner = item.children().filter(|child| child.has_tag_name("ul"));
                blocks.push(Block::Item(depth, text(item)));
                inner.for_each(|list| add(list, depth + 1, blocks));
            }
        }
        "table" => blocks.push(Block::Table(table(node))),
        "figure" => blocks.extend(picture(node).map(|one| side_by_side(node, vec![one]))),
        "div" if has_class(node, "pictures") || has_class(node, "grid") => {
            let figures = node.children().filter(|child| child.has_tag_name("figure"));
            let pictures: Vec<_> = figures.filter_map(picture).collect();
            let places = if has_class(node, "four") { 4 } else { 2 };
            let mut pictures = pictures.into_iter().peekable();
            while pictures.peek().is_some() {
                let row = pictures.by_ref().take(places).collect();
                blocks.push(side_by_side(node, row));
            }
        }
        "section" if has_class(node, "sheet") => {
            blocks.push(Block::Sheet(beside_each_other(of(node))));
        }
        "div" if has_class(node, "columns") => {
            let columns = node.children().filter(Node::is_element).map(of);
            blocks.push(Block::Columns(columns.collect()));
        }
        "script" | "noscript" | "svg" => {}
        _ => {
            for child in node.children().filter(Node::is_element) {
                add(child, depth, blocks);
            }
        }
    }
}

/// Rows of pictures that have room beside each other: three small ones at most.
fn beside_each_other<'a>(blocks: Vec<Block<'a>>) -> Vec<Block<'a>> {
    let mut together: Vec<Block<'a>> = Vec::new();
    for block in blocks {
        match (together.last_mut(), block) {
            (Some(Block::Pictures { pictures, .. }), Block::Pictures { pictures: more, .. })
                if pictures.len() + more.len() <= MOST_BESIDE =>
            {
                pictures.extend(more);
            }
            (_, block) => together.push(block),
        }
    }
    together
}

fn side_by_side<'a>(node: Node<'a, 'a>, pictures: Vec<(Node<'a, 'a>, String)>) -> Block<'a> {
    let small = node.ancestors().any(|outer| has_class(outer, "sheet"));
    Block::Pictures { pictures, small }
}

fn picture<'a>(figure: Node<'a, 'a>) -> Option<(Node<'a, 'a>, String)> {
    let child = |name: &'static str| {
        figure
            .children()
            .find(move |child| child.has_tag_name(name))
    };
    // an empty element is drawn by the page's script
    let svg = child("svg").filter(Node::has_children)?;
    Some((svg, child("figcaption").map(text).unwrap_or_default()))
}

fn table(node: Node<'_, '_>) -> Table {
    let mut table = Table::default();
    for row in node.descendants().filter(|child| child.has_tag_name("tr")) {
        let cells: Vec<Node<'_, '_>> = row.children().filter(Node::is_element).collect();
        let texts: Vec<String> = cells.iter().map(|&cell| text(cell)).collect();
        let is_head = cells.iter().all(|cell| cell.has_tag_name("th"));
        match is_head && table.rows.is_empty() && table.head.is_empty() {
            true => table.head = texts,
            false => {
                table.names_rows |= cells.first().is_some_and(|cell| cell.has_tag_name("th"));
                table.rows.push(texts);
            }
        }
    }
    table
}

/// The text of an element without that of lists inside, with single spaces.
fn text(node: Node<'_, '_>) -> String {
    let mut whole = String::new();
    collect(node, &mut whole);
    whole.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn collect(node: Node<'_, '_>, whole: &mut String) {
    for child in node.children() {
        match child.text() {
            Some(text) if child.is_text() => whole.push_str(text),
            _ if child.has_tag_name("ul") => {}
            _ => {
                collect(child, whole);
                if child.has_tag_name("strong") {
                    whole.push(' ');
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_becomes_blocks_without_what_only_a_screen_shows() {
        let markup = r#"<r><section><h2>A</h2><p>one <b>two</b></p><ul><li>x<ul><li>y</li></ul></li></ul>
            <div class="moment screen"><p>no</p></div>
            <table><thead><tr><th>H</th></tr></thead><tbody><tr><td>1</td></tr></tbody></table></section></r>"#;
        let tree = roxmltree::Document::parse(markup).unwrap();
        let found = of(tree.root_element());
        let [
            Block::Heading(2, a),
            Block::Paragraph(p),
            Block::Item(0, x),
            Block::Item(1, y),
            Block::Table(t),
        ] = &found[..]
        else {
            panic!("{found:?}");
        };
        assert_eq!([a, p, x, y], ["A", "one two", "x", "y"]);
        assert_eq!(
            (t.head.clone(), t.rows.clone()),
            (vec!["H".to_string()], vec![vec!["1".to_string()]])
        );
    }
}
