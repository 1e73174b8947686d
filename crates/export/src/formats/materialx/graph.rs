//! Nodes, and elements of XML.

use quick_xml::events::{BytesText, Event};

/// An element with its attributes and children.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    tag: String,
    attributes: Vec<(&'static str, String)>,
    pub(super) children: Vec<Element>,
}

impl Element {
    pub(super) fn named(tag: &str, attributes: &[(&'static str, String)]) -> Self {
        Self { tag: tag.into(), attributes: attributes.to_vec(), children: Vec::new() }
    }

    pub(super) fn new(tag: &str, attributes: &[(&'static str, &str)]) -> Self {
        let attributes: Vec<(&'static str, String)> =
            attributes.iter().map(|(k, v)| (*k, (*v).to_owned())).collect();
        Self::named(tag, &attributes)
    }

    /// A node of a graph, which gives it its name.
    pub(super) fn node(category: &str, kind: &str, inputs: &[(&'static str, &str, Arg)]) -> Self {
        let mut node = Self::new(category, &[("name", ""), ("type", kind)]);
        node.children = inputs.iter().map(|(name, kind, arg)| input(name, kind, arg)).collect();
        node
    }

    /// The document with this root and a comment at its head.
    pub(super) fn document(&self, head: &[String]) -> String {
        // Two hyphens end a comment.
        let head: Vec<String> = head.iter().map(|line| format!("  {}", line.replace("--", "- -"))).collect();
        let head: Vec<&str> = head.iter().map(|line| line.trim_end()).collect();
        let mut writer = quick_xml::Writer::new_with_indent(Vec::new(), b' ', 2);
        let comment = Event::Comment(BytesText::from_escaped(format!("\n{}\n", head.join("\n"))));
        // Writing to memory does not fail.
        writer.write_event(comment).and_then(|()| self.write(&mut writer)).unwrap_or_default();
        let body = String::from_utf8(writer.into_inner()).unwrap_or_default();
        format!("<?xml version=\"1.0\"?>\n{body}\n")
    }

    fn write(&self, writer: &mut quick_xml::Writer<Vec<u8>>) -> std::io::Result<()> {
        let attributes = self.attributes.iter().map(|(name, value)| (*name, value.as_str()));
        let element = writer.create_element(self.tag.as_str()).with_attributes(attributes);
        if self.children.is_empty() {
            return element.write_empty().map(|_| ());
        }
        let inner =
            |writer: &mut quick_xml::Writer<Vec<u8>>| self.children.iter().try_for_each(|c| c.write(writer));
        element.write_inner_content(inner).map(|_| ())
    }
}

/// What a node's input is connected to.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Arg {
    /// A node, and which of its outputs where it has several.
    Node(String, Option<&'static str>),
    /// An input of the graph.
    Interface(String),
    /// A number, or several.
    Value(String),
}

impl Arg {
    pub(super) fn node(name: &str) -> Self {
        Self::Node(name.into(), None)
    }

    pub(super) fn value(text: String) -> Self {
        Self::Value(text)
    }
}

/// The nodes of a graph.
#[derive(Default)]
pub(super) struct Graph {
    pub(super) nodes: Vec<Element>,
}

impl Graph {
    /// Adds a node and returns its name. A node that is there already is used again.
    pub(super) fn add(
        &mut self,
        category: &str,
        kind: &str,
        name: &str,
        inputs: &[(&'static str, &str, Arg)],
    ) -> String {
        let node = Element::node(category, kind, inputs);
        let is_same = |other: &&Element| {
            other.tag == node.tag
                && other.attributes[1] == node.attributes[1]
                && other.children == node.children
        };
        match self.nodes.iter().find(is_same) {
            Some(same) => same.attributes[0].1.clone(),
            None => self.push(node, name),
        }
    }

    /// Adds a node even if there is one like it, and returns its name. Nodes are named once, and not like outputs.
    pub(super) fn push(&mut self, mut node: Element, name: &str) -> String {
        let is_taken = |name: &str| self.nodes.iter().any(|n| n.attributes[0].1 == name);
        let numbered = (2..).map(|n| format!("{name}_{n}"));
        let name = [name.to_owned()].into_iter().chain(numbered).find(|n| !is_taken(n)).unwrap_or_default();
        node.attributes[0].1.clone_from(&name);
        self.nodes.push(node);
        name
    }
}

fn input(name: &str, kind: &str, arg: &Arg) -> Element {
    let mut attributes = vec![("name", name.to_owned()), ("type", kind.to_owned())];
    match arg {
        Arg::Node(node, output) => {
            attributes.push(("nodename", node.clone()));
            attributes.extend(output.map(|output| ("output", output.to_owned())));
        }
        Arg::Interface(name) => attributes.push(("interfacename", name.clone())),
        Arg::Value(value) => attributes.push(("value", value.clone())),
    }
    Element::named("input", &attributes)
}
