//! What a model must take and give, as data: names, element types and shapes. A model that fits none of a port's names, or
//! has another shape, is refused before it runs.

use core::fmt;

/// One side of a tensor, as a contract states it.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Side {
    /// Exactly this long. A model that leaves the side open passes; its outputs are checked again when they come.
    Is(usize),
    /// Any length, called this.
    Any(&'static str),
}

/// Element type of a tensor.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Element {
    /// 32-bit float.
    F32,
    /// 64-bit integer.
    I64,
    /// Either: exporters differ.
    F32OrI64,
}

/// An input or output.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Names under which exporters write it; the first is the contract's own.
    pub names: &'static [&'static str],
    /// Its elements.
    pub element: Element,
    /// Its shapes, first the contract's own; exporters differ about the batch's side.
    pub shapes: &'static [&'static [Side]],
}

/// What a model takes and gives.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Contract {
    /// The name in configurations.
    pub name: &'static str,
    /// What goes in.
    pub inputs: &'static [Port],
    /// What comes out; a model may give more.
    pub outputs: &'static [Port],
    /// In words: units, ranges and what is done with it.
    pub explanation: &'static str,
}

/// A port as a loaded model states it. A side of `None` is open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundPort {
    /// Its name.
    pub name: String,
    /// Its elements, `None` if neither of the two.
    pub element: Option<Element>,
    /// Its shape; empty where even the number of sides is open.
    pub shape: Vec<Option<usize>>,
}

/// How a model's ports serve a contract: for each of the contract's, the index of the model's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Per input of the contract.
    pub inputs: Vec<usize>,
    /// Per output of the contract.
    pub outputs: Vec<usize>,
}

/// A port that does not fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// What the contract asks for.
    pub expected: String,
    /// What the model has.
    pub found: String,
}

impl Contract {
    /// Which of the model's ports serve.
    ///
    /// # Errors
    /// [`Misfit`] for the first port that is missing or has another type or shape, and for an input too many.
    pub fn bind(&self, inputs: &[FoundPort], outputs: &[FoundPort]) -> Result<Binding, Misfit> {
        let bound =
            Binding { inputs: bind("input", self.inputs, inputs)?, outputs: bind("output", self.outputs, outputs)? };
        if let Some(extra) = (0..inputs.len()).find(|i| !bound.inputs.contains(i)) {
            let expected = format!("{} input(s)", self.inputs.len());
            return Err(Misfit { expected, found: format!("also input {}", inputs[extra]) });
        }
        Ok(bound)
    }
}

fn bind(kind: &str, wanted: &[Port], found: &[FoundPort]) -> Result<Vec<usize>, Misfit> {
    let indices = wanted.iter().map(|port| {
        let at = found.iter().position(|f| port.names.contains(&f.name.as_str()));
        match at {
            Some(i) if port.admits(&found[i]) => Ok(i),
            Some(i) => Err(Misfit { expected: format!("{kind} {port}"), found: found[i].to_string() }),
            None => {
                let names: Vec<String> = found.iter().map(ToString::to_string).collect();
                let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                Err(Misfit { expected: format!("{kind} {port}"), found: names })
            }
        }
    });
    indices.collect()
}

impl Port {
    fn admits(&self, found: &FoundPort) -> bool {
        let element = match self.element {
            Element::F32OrI64 => found.element.is_some(),
            wanted => found.element == Some(wanted),
        };
        element && (found.shape.is_empty() || self.shapes.iter().any(|shape| fits(shape, &found.shape)))
    }

    /// Whether a tensor that came out has one of the shapes.
    #[must_use]
    pub fn has_shape(&self, shape: &[usize]) -> bool {
        let sides: Vec<Option<usize>> = shape.iter().map(|&n| Some(n)).collect();
        self.shapes.iter().any(|wanted| fits(wanted, &sides))
    }
}

fn fits(wanted: &[Side], found: &[Option<usize>]) -> bool {
    let side = |(wanted, found): (&Side, &Option<usize>)| match (wanted, found) {
        (Side::Is(n), Some(m)) => n == m,
        _ => true,
    };
    wanted.len() == found.len() && wanted.iter().zip(found).all(side)
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = match self.element {
            Element::F32 => "float32",
            Element::I64 => "int64",
            Element::F32OrI64 => "float32 or int64",
        };
        let shapes: Vec<String> = self
            .shapes
            .iter()
            .map(|shape| shape.iter().map(ToString::to_string).collect::<Vec<_>>().join("x"))
            .collect();
        let names: Vec<String> = self.names.iter().map(|name| format!("\"{name}\"")).collect();
        write!(f, "{} {} {element}", names.join(" or "), shapes.join(" or "))
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Is(n) => write!(f, "{n}"),
            Self::Any(name) => f.write_str(name),
        }
    }
}

impl fmt::Display for FoundPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let element = match self.element {
            Some(Element::F32) => "float32",
            Some(Element::I64) => "int64",
            _ => "of another type",
        };
        let sides: Vec<String> = self.shape.iter().map(|n| n.map_or("?".to_owned(), |n| n.to_string())).collect();
        write!(f, "\"{}\" {} {element}", self.name, sides.join("x"))
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    const CONTRACT: Contract = Contract {
        name: "test",
        inputs: &[Port {
            names: &["image", "input"],
            element: Element::F32,
            shapes: &[&[Side::Is(1), Side::Any("H"), Side::Any("W")]],
        }],
        outputs: &[Port { names: &["points"], element: Element::F32OrI64, shapes: &[&[Side::Any("N"), Side::Is(2)]] }],
        explanation: "",
    };

    fn found(name: &str, element: Option<Element>, shape: &[Option<usize>]) -> FoundPort {
        FoundPort { name: name.to_owned(), element, shape: shape.to_vec() }
    }

    #[test]
    fn ports_are_found_by_any_of_their_names_and_may_leave_sides_open() {
        let image = found("input", Some(Element::F32), &[None, Some(480), Some(640)]);
        let more = found("more", None, &[]);
        let points = found("points", Some(Element::I64), &[None, None]);
        let bound = CONTRACT.bind(&[image], &[more, points]).unwrap();
        assert_eq!(bound, Binding { inputs: vec![0], outputs: vec![1] });
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let image = || found("image", Some(Element::F32), &[Some(1), None, None]);
        let points = || found("points", Some(Element::F32), &[None, Some(2)]);
        let misfit = |i: &[FoundPort], o: &[FoundPort]| {
            let misfit = CONTRACT.bind(i, o).unwrap_err();
            format!("expected {}, found {}", misfit.expected, misfit.found)
        };
        assert_eq!(
            misfit(&[image()], &[found("points", Some(Element::F32), &[None, Some(3)])]),
            "expected output \"points\" Nx2 float32 or int64, found \"points\" ?x3 float32"
        );
        assert_eq!(
            misfit(&[found("x", Some(Element::F32), &[None])], &[points()]),
            "expected input \"image\" or \"input\" 1xHxW float32, found \"x\" ? float32"
        );
        assert!(misfit(&[found("image", None, &[None, None, None])], &[points()]).ends_with("of another type"));
        assert!(misfit(&[image(), found("mask", None, &[])], &[points()]).contains("also input \"mask\""));
        assert!(misfit(&[image()], &[]).ends_with("found none"));
    }
}
