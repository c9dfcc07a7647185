//! Small ONNX models, written byte by byte (protobuf wire format, onnx.proto3 field numbers): enough to fulfil a contract, or
//! to break it in one place.

/// Floats or integers in a port.
#[derive(Copy, Clone)]
pub enum Kind {
    Float = 1,
    Int64 = 7,
    Double = 11,
}

/// A side of a port: a length or a name.
#[derive(Copy, Clone)]
pub enum Side {
    Is(u64),
    Named(&'static str),
}

/// What a model is made of.
#[derive(Clone, Default)]
pub struct Model {
    pub opset: u64,
    nodes: Vec<u8>,
    constants: Vec<u8>,
    inputs: Vec<u8>,
    outputs: Vec<u8>,
}

fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

fn message(field: u64, content: &[u8]) -> Vec<u8> {
    [varint(field << 3 | 2), varint(content.len() as u64), content.to_vec()].concat()
}

fn port(name: &str, kind: Kind, sides: &[Side]) -> Vec<u8> {
    let side = |side: &Side| match side {
        Side::Is(n) => message(1, &number(1, *n)),
        Side::Named(name) => message(1, &message(2, name.as_bytes())),
    };
    let shape: Vec<u8> = sides.iter().flat_map(side).collect();
    let tensor = [number(1, kind as u64), message(2, &shape)].concat();
    [message(1, name.as_bytes()), message(2, &message(1, &tensor))].concat()
}

impl Model {
    pub fn new() -> Self {
        Self { opset: 13, ..Self::default() }
    }

    pub fn input(mut self, name: &str, kind: Kind, sides: &[Side]) -> Self {
        self.inputs.extend(message(11, &port(name, kind, sides)));
        self
    }

    pub fn output(mut self, name: &str, kind: Kind, sides: &[Side]) -> Self {
        self.outputs.extend(message(12, &port(name, kind, sides)));
        self
    }

    /// A float tensor by name.
    pub fn constant(mut self, name: &str, sides: &[u64], values: &[f32]) -> Self {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let dims: Vec<u8> = sides.iter().flat_map(|&n| number(1, n)).collect();
        let tensor = [dims, number(2, Kind::Float as u64), message(8, name.as_bytes()), message(9, &raw)].concat();
        self.constants.extend(message(5, &tensor));
        self
    }

    /// An operator with attributes that are lists of integers, or one integer where the list has length 1 and the name ends
    /// in `*`.
    pub fn node(mut self, operator: &str, from: &[&str], to: &str, attributes: &[(&str, &[u64])]) -> Self {
        let mut node: Vec<u8> = from.iter().flat_map(|name| message(1, name.as_bytes())).collect();
        node.extend(message(2, to.as_bytes()));
        node.extend(message(4, operator.as_bytes()));
        for (name, values) in attributes {
            let attribute = match name.strip_suffix('*') {
                Some(name) => [message(1, name.as_bytes()), number(3, values[0]), number(20, 2)].concat(),
                None => {
                    let list: Vec<u8> = values.iter().flat_map(|&v| number(8, v)).collect();
                    [message(1, name.as_bytes()), list, number(20, 7)].concat()
                }
            };
            node.extend(message(5, &attribute));
        }
        self.nodes.extend(message(1, &node));
        self
    }

    pub fn bytes(&self) -> Vec<u8> {
        let graph = [
            self.nodes.clone(),
            message(2, b"graph"),
            self.constants.clone(),
            self.inputs.clone(),
            self.outputs.clone(),
        ];
        let opset = message(8, &number(2, self.opset));
        [number(1, 8), opset, message(7, &graph.concat())].concat()
    }
}

use Side::{Is, Named};

/// A model of contract `homing` that knows nothing: heat is brightness, descriptors are random filters, reliability is 1.
/// `dimension` other than 64 breaks the contract.
pub fn homing_extractor(dimension: u64) -> Model {
    let filters: Vec<f32> = (0..dimension * 64).map(|i| ((i * 7919 % 1009) as f32 - 504.0) * 1e-3).collect();
    Model::new()
        .input("image", Kind::Float, &[Is(1), Is(1), Named("H"), Named("W")])
        .constant("scale", &[1], &[1.0 / 255.0])
        .constant("zero", &[1], &[0.0])
        .constant("one", &[1], &[1.0])
        .constant("filters", &[dimension, 1, 8, 8], &filters)
        .node("Mul", &["image", "scale"], "heat_map", &[])
        .node("Conv", &["image", "filters"], "descriptors", &[("kernel_shape", &[8, 8]), ("strides", &[8, 8])])
        .node("AveragePool", &["image"], "mean", &[("kernel_shape", &[8, 8]), ("strides", &[8, 8])])
        .node("Mul", &["mean", "zero"], "nothing", &[])
        .node("Add", &["nothing", "one"], "reliability", &[])
        .output("heat_map", Kind::Float, &[Is(1), Is(1), Named("H"), Named("W")])
        .output("descriptors", Kind::Float, &[Is(1), Is(dimension), Named("h"), Named("w")])
        .output("reliability", Kind::Float, &[Is(1), Is(1), Named("h"), Named("w")])
}

/// A model of contract `homing-switch`: by `operator`, of the largest cosine between two keypoints.
pub fn homing_switch(operator: &str) -> Model {
    let mut model = Model::new();
    for (i, n) in [("0", Named("N0")), ("1", Named("N1"))] {
        model = model
            .input(&format!("keypoints{i}"), Kind::Float, &[n, Is(2)])
            .input(&format!("descriptors{i}"), Kind::Float, &[n, Is(64)])
            .input(&format!("scores{i}"), Kind::Float, &[n]);
    }
    model
        .node("Transpose", &["descriptors1"], "turned", &[("perm", &[1, 0])])
        .node("MatMul", &["descriptors0", "turned"], "similarity", &[])
        .node("ReduceMax", &["similarity"], "best", &[("axes", &[1]), ("keepdims*", &[0])])
        .node("ReduceMax", &["best"], "cosine", &[("axes", &[0]), ("keepdims*", &[1])])
        .node(operator, &["cosine"], "probability", &[])
        .output("probability", Kind::Float, &[Is(1)])
}

/// A model of contract `homing-matcher`: the most similar keypoint, its cosine as confidence. With or without a batch, and
/// the names that go with it.
pub fn homing_matcher(dimension: u64, batch: &[Side]) -> Model {
    let (kpts, desc) = if batch.is_empty() { ("keypoints", "descriptors") } else { ("kpts", "desc") };
    let rank = batch.len() as u64 + 2;
    let shape = |sides: &[Side]| [batch, sides].concat();
    let mut model = Model::new();
    for (i, n) in [("0", Named("N0")), ("1", Named("N1"))] {
        model = model
            .input(&format!("{kpts}{i}"), Kind::Float, &shape(&[n, Is(2)]))
            .input(&format!("{desc}{i}"), Kind::Float, &shape(&[n, Is(dimension)]))
            .input(&format!("scores{i}"), Kind::Float, &shape(&[n]));
    }
    let turned: Vec<u64> = if batch.is_empty() { vec![1, 0] } else { vec![0, 2, 1] };
    let confidences = if batch.is_empty() { "confidences0" } else { "confidence0" };
    model
        .node("Transpose", &[&format!("{desc}1")], "turned", &[("perm", &turned)])
        .node("MatMul", &[&format!("{desc}0"), "turned"], "similarity", &[])
        .node("ArgMax", &["similarity"], "matches0", &[("axis*", &[rank - 1]), ("keepdims*", &[0])])
        .node("ReduceMax", &["similarity"], confidences, &[("axes", &[rank - 1]), ("keepdims*", &[0])])
        .output("matches0", Kind::Int64, &shape(&[Named("N0")]))
        .output(confidences, Kind::Float, &shape(&[Named("N0")]))
}
