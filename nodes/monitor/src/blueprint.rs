//! How the viewer lays everything out at first sight.
//!
//! The SDK's own view types do not let a view's background, bounds or axes be set, so the layout is written to the
//! blueprint store directly, in the form the viewer reads: `container/<id>`, `view/<id>`, `view/<id>/<property>`.

use rerun::blueprint::components::{BackgroundKind, Corner2D, QueryExpression, ViewClass};
use rerun::blueprint::components::{
    ColumnShare, ContainerKind, IncludedContent, PanelState, PlayState, RootContainer, RowShare,
};
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes as bp;
use rerun::external::re_sdk_types::blueprint::components::{TextLogColumn, VisualBounds2D};
use rerun::external::re_sdk_types::blueprint::datatypes::{self as blueprint, TextLogColumnKind};
use rerun::external::re_sdk_types::datatypes::{Range1D, Range2D, Uuid};
use rerun::log::LogMsg;
use rerun::{ApplicationId, AsComponents, Color, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use crate::entities;
use crate::palette::dark;
use crate::scene::camera;

/// Sends the layout down a stream and makes it the active one.
pub(crate) fn send(stream: &RecordingStream, application_id: &str) -> RecordingStreamResult<()> {
    let messages = build(application_id)?;
    if let Some(LogMsg::SetStoreInfo(info)) = messages.first() {
        let blueprint_id = info.info.store_id.clone();
        let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        stream.send_blueprint(messages, activation);
    }
    Ok(())
}

fn build(application_id: &str) -> RecordingStreamResult<Vec<LogMsg>> {
    let (stream, storage) =
        RecordingStreamBuilder::new(ApplicationId::new_or_unknown(application_id)).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    let root = layout();
    let mut writer = BlueprintWriter { stream, family: family_of(&root), last_id: 0 };
    let root_id = writer.write(&root)?;
    let root = RootContainer(Uuid { bytes: id_bytes(writer.family, root_id) });
    let viewport =
        bp::ViewportBlueprint::new().with_root_container(root).with_auto_layout(false).with_auto_views(false);
    writer.stream.log("viewport", &viewport)?;
    let hidden = bp::PanelBlueprint::new().with_state(PanelState::Hidden);
    writer.stream.log("blueprint_panel", &hidden)?;
    writer.stream.log("selection_panel", &hidden)?;
    let time = bp::TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(entities::STEP)
        .with_play_state(PlayState::Following)
        .with_fps(10.0);
    writer.stream.log("time_panel", &time)?;
    Ok(storage.take())
}

/// What the viewer shows: what the robot sees, the map, and what is said; below, what it does over time.
fn layout() -> Node {
    let ground = Color::from_rgb(dark::GROUND[0], dark::GROUND[1], dark::GROUND[2]);
    let background = || bp::Background::new(BackgroundKind::SolidColor).with_color(ground);
    let legend = || bp::PlotLegend::new().with_corner(Corner2D::LeftTop);
    let column = |kind| TextLogColumn(blueprint::TextLogColumn { kind, visible: true.into() });
    let columns = [column(TextLogColumnKind::LogLevel), column(TextLogColumnKind::Body)];
    let (x_range, y_range) = camera::BOUNDS;
    let bounds = Range2D { x_range: Range1D(x_range), y_range: Range1D(y_range) };
    let matches = View::new("2D", "Camera and goal photo", entities::MATCHES)
        .with("Background", background())
        .with("VisualBounds2D", bp::VisualBounds2D::new(VisualBounds2D(bounds)));
    let depth = View::new("2D", "Depth, 0 to 6 m", entities::DEPTH).with("Background", background());
    let summary = View::new("TextDocument", "Episode", entities::SUMMARY);
    let map =
        View::new("2D", "Map from above, m", "/").with_contents(&[entities::MAP]).with("Background", background());
    let log = View::new("TextLog", "Log", entities::LOG)
        .with("TextLogColumns", bp::TextLogColumns::new().with_text_log_columns(columns));
    let modes = View::new("TimeSeries", "Mode", entities::MODE)
        .with("PlotLegend", legend())
        .with("ScalarAxis", bp::ScalarAxis::new().with_range(Range1D([-0.5, 6.5])));
    let latency = View::new("TimeSeries", "Latency, ms", entities::LATENCY).with("PlotLegend", legend());
    let counts = View::new("TimeSeries", "Matches to the goal photo", entities::COUNTS).with("PlotLegend", legend());
    let seen = Node::vertical(
        &[1.0, 1.0],
        vec![matches.into(), Node::horizontal(&[1.0, 0.9], vec![depth.into(), summary.into()])],
    );
    let upper = Node::horizontal(&[1.35, 1.3, 0.65], vec![seen, map.into(), log.into()]);
    let lower = Node::horizontal(&[1.35, 0.98, 0.97], vec![modes.into(), latency.into(), counts.into()]);
    Node::vertical(&[2.7, 1.0], vec![upper, lower])
}

enum Node {
    Container { kind: ContainerKind, shares: Vec<f32>, children: Vec<Node> },
    View(View),
}

impl Node {
    fn horizontal(shares: &[f32], children: Vec<Node>) -> Self {
        Node::Container { kind: ContainerKind::Horizontal, shares: shares.to_vec(), children }
    }

    fn vertical(shares: &[f32], children: Vec<Node>) -> Self {
        Node::Container { kind: ContainerKind::Vertical, shares: shares.to_vec(), children }
    }
}

impl From<View> for Node {
    fn from(view: View) -> Self {
        Node::View(view)
    }
}

struct View {
    class: &'static str,
    title: &'static str,
    origin: &'static str,
    contents: Vec<String>,
    properties: Vec<(&'static str, Box<dyn AsComponents>)>,
}

impl View {
    fn new(class: &'static str, title: &'static str, origin: &'static str) -> Self {
        Self { class, title, origin, contents: vec!["$origin/**".to_owned()], properties: Vec::new() }
    }

    fn with_contents(mut self, entities: &[&str]) -> Self {
        self.contents = entities.iter().map(|e| format!("+ /{e}/**")).collect();
        self
    }

    fn with(mut self, name: &'static str, property: impl AsComponents + 'static) -> Self {
        self.properties.push((name, Box::new(property)));
        self
    }
}

struct BlueprintWriter {
    stream: RecordingStream,
    family: u32,
    last_id: u8,
}

impl BlueprintWriter {
    /// Writes a node and everything below it, and returns its identity.
    fn write(&mut self, node: &Node) -> RecordingStreamResult<u8> {
        self.last_id += 1;
        let id = self.last_id;
        match node {
            Node::View(view) => self.write_view(id, view)?,
            Node::Container { kind, shares, children } => self.write_container(id, *kind, shares, children)?,
        }
        Ok(id)
    }

    fn write_container(
        &mut self,
        id: u8,
        kind: ContainerKind,
        shares: &[f32],
        children: &[Node],
    ) -> RecordingStreamResult<()> {
        let mut contents = Vec::new();
        for child in children {
            let child_id = self.write(child)?;
            contents.push(IncludedContent(self.path_of(child, child_id).into()));
        }
        let container = bp::ContainerBlueprint::new(kind).with_contents(contents);
        let container = match kind {
            ContainerKind::Horizontal => container.with_col_shares(shares.iter().map(|&s| ColumnShare(s.into()))),
            _ => container.with_row_shares(shares.iter().map(|&s| RowShare(s.into()))),
        };
        self.stream.log(format!("container/{}", uuid_of(self.family, id)), &container)
    }

    fn path_of(&self, node: &Node, id: u8) -> String {
        let kind = if matches!(node, Node::View(_)) { "view" } else { "container" };
        format!("{kind}/{}", uuid_of(self.family, id))
    }

    fn write_view(&self, id: u8, view: &View) -> RecordingStreamResult<()> {
        let path = format!("view/{}", uuid_of(self.family, id));
        let query = view.contents.iter().map(|q| QueryExpression(q.as_str().into()));
        self.stream.log(format!("{path}/ViewContents"), &bp::ViewContents::new(query))?;
        let blueprint = bp::ViewBlueprint::new(ViewClass(view.class.into()))
            .with_display_name(view.title)
            .with_space_origin(view.origin);
        self.stream.log(path.as_str(), &blueprint)?;
        for (name, property) in &view.properties {
            self.stream.log(format!("{path}/{name}"), property.as_ref())?;
        }
        Ok(())
    }
}

/// Identities are derived, not drawn, so that the same layout has the same ones in every recording. The family tells
/// layouts apart: a viewer remembers a view's class by identity, and fails on a known one with another class.
fn id_bytes(family: u32, id: u8) -> [u8; 16] {
    let [a, b, c, d] = family.to_be_bytes();
    [a, b, c, d, 0x68, 0x6f, 0x40, 0x6d, 0x80, 0x69, 0x6e, 0x67, 0, 0, 0, id]
}

fn uuid_of(family: u32, id: u8) -> String {
    let hex: String = id_bytes(family, id).iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

/// FNV-1a over classes and titles, in order.
fn family_of(node: &Node) -> u32 {
    fn mix(hash: u32, text: &str) -> u32 {
        text.bytes().fold(hash, |h, byte| (h ^ u32::from(byte)).wrapping_mul(16_777_619))
    }
    fn walk(hash: u32, node: &Node) -> u32 {
        match node {
            Node::View(view) => mix(mix(hash, view.class), view.title),
            Node::Container { children, .. } => children.iter().fold(mix(hash, "("), walk),
        }
    }
    walk(2_166_136_261, node)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_builds_and_starts_with_its_store() {
        let messages = build("test").unwrap();
        assert!(matches!(messages.first(), Some(LogMsg::SetStoreInfo(_))));
        // Nine views with contents and class, five containers, viewport and three panels.
        let rows: usize = messages.iter().filter(|m| matches!(m, LogMsg::ArrowMsg(..))).count();
        assert!(rows >= 27, "{rows}");
    }

    #[test]
    fn text_and_bytes_of_an_identity_agree() {
        let hex: String = id_bytes(7, 0x1f).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(uuid_of(7, 0x1f).replace('-', ""), hex);
    }
}
