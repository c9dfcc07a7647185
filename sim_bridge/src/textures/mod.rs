//! Procedural surfaces: enough texture for a camera, enough sameness to be hard.

use crate::scene::Texture;

/// Kinds of surface the flat generator asks for. One texture covers [`Surface::side_m`] metres of the surface where it
/// repeats, or the whole quad (uv 0..1) where it is a picture.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Surface {
    /// Floor planks, repeats.
    WoodFloor,
    /// Herringbone or block parquet, repeats.
    Parquet,
    /// Square tiles with joints, repeats.
    Tile,
    /// Brick wall, repeats.
    Brick,
    /// Painted plaster: faint grain, stains and scratches, repeats.
    Plaster,
    /// Wallpaper with a repeated motif, repeats.
    Wallpaper,
    /// Woven fabric: sofas, beds, curtains, repeats.
    Fabric,
    /// Furniture wood, repeats.
    WoodGrain,
    /// A rug with border and ornament, a picture.
    Rug,
    /// A poster with shapes and lettering, a picture.
    Poster,
    /// A shelf full of books, a picture.
    Books,
    /// The view out of a window with its frame, a picture (shown unlit).
    Window,
    /// A door leaf with panels and handle, a picture.
    Door,
    /// A fridge, oven or cupboard front, a picture.
    Appliance,
    /// A screen, a picture.
    Screen,
    /// Leaves of a plant, repeats.
    Leaves,
}

impl Surface {
    /// Metres covered by one repetition; 0 for pictures.
    #[must_use]
    pub fn side_m(self) -> f32 {
        todo_side(self)
    }
}

fn todo_side(_surface: Surface) -> f32 {
    2.0
}

/// Draws a surface. Equal arguments give equal bytes on every machine.
#[must_use]
pub fn draw(surface: Surface, seed: u64) -> Texture {
    let shade = (seed as u8).wrapping_add(surface as u8 * 13) | 0x40;
    Texture { width: 1, height: 1, rgba: vec![shade, shade, shade, 255] }
}
