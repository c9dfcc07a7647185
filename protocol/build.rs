//! Generates the Rust types of our ROS 2 interfaces from `msg/`, `srv/` and `action/`.

use std::collections::HashSet;
use std::error::Error;
use std::path::{Path, PathBuf};

use hiroz_codegen::{GeneratorConfig, MessageGenerator, discover_bundled_packages};

fn main() -> Result<(), Box<dyn Error>> {
    for folder in ["msg", "srv", "action", "package.xml"] {
        println!("cargo:rerun-if-changed={folder}");
    }
    let output_dir = PathBuf::from(std::env::var("OUT_DIR")?);
    let bundled = discover_bundled_packages(false)?;
    // Packages for tests hold fields that the generator warns of, on every build.
    let ours = |path: &&Path| !path.ends_with("test_interface_files") && !path.ends_with("example_interfaces");
    let bundled: Vec<&Path> = bundled.iter().map(PathBuf::as_path).filter(ours).collect();
    MessageGenerator::new(GeneratorConfig {
        generate_cdr: true,
        generate_protobuf: false,
        generate_type_info: true,
        is_humble: false,
        output_dir: output_dir.clone(),
        external_crate: Some("hiroz_msgs".into()),
        local_packages: HashSet::from(["homing_msgs".into()]),
        json_out: None,
    })
    .generate_from_msg_files_with_deps(&[Path::new(".")], &bundled)?;
    correct_cancel_hash(&output_dir.join("generated.rs"))
}

/// The generator's type hash of `action_msgs/srv/CancelGoal` differs from the one ROS 2 computes; with it no ROS client
/// could cancel.
fn correct_cancel_hash(generated: &Path) -> Result<(), Box<dyn Error>> {
    const RIGHT: &str = "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a";
    const WRONG_START: &str = "RIHS01_022cb8eb";
    let mut text = std::fs::read_to_string(generated)?;
    while let Some(at) = text.find(WRONG_START) {
        text.replace_range(at..at + RIGHT.len(), RIGHT);
    }
    Ok(std::fs::write(generated, text)?)
}
