//! Procedural surfaces: enough texture for a camera, enough sameness to be hard.
//!
//! Every texture is a pure function of surface and seed: integer hashes and `libm` only, so equal arguments give equal
//! bytes on every machine. Colours are chosen in sRGB.

mod canvas;
mod cloth;
mod floors;
mod fronts;
mod lettering;
mod noise;
mod outdoors;
mod palette;
mod posters;
mod walls;
mod wood;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

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
    /// Every kind.
    pub const ALL: [Surface; 16] = [
        Surface::WoodFloor,
        Surface::Parquet,
        Surface::Tile,
        Surface::Brick,
        Surface::Plaster,
        Surface::Wallpaper,
        Surface::Fabric,
        Surface::WoodGrain,
        Surface::Rug,
        Surface::Poster,
        Surface::Books,
        Surface::Window,
        Surface::Door,
        Surface::Appliance,
        Surface::Screen,
        Surface::Leaves,
    ];

    /// Metres covered by one repetition; 0 for pictures.
    #[must_use]
    pub fn side_m(self) -> f32 {
        match self {
            Surface::WoodFloor => 1.6,
            Surface::Parquet | Surface::Tile => 1.2,
            Surface::Brick => 1.25,
            Surface::Plaster => 2.5,
            Surface::Wallpaper => 1.0,
            Surface::Fabric => 0.4,
            Surface::WoodGrain => 0.8,
            Surface::Leaves => 0.3,
            Surface::Rug
            | Surface::Poster
            | Surface::Books
            | Surface::Window
            | Surface::Door
            | Surface::Appliance
            | Surface::Screen => 0.0,
        }
    }
}

/// Draws a surface. Equal arguments give equal bytes on every machine.
#[must_use]
pub fn draw(surface: Surface, seed: u64) -> Texture {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed ^ ((surface as u64 + 1) << 56));
    let canvas = match surface {
        Surface::WoodFloor => floors::planks(rng),
        Surface::Parquet => floors::parquet(rng),
        Surface::Tile => floors::tiles(rng),
        Surface::Brick => walls::brick(rng),
        Surface::Plaster => walls::plaster(rng),
        Surface::Wallpaper => walls::wallpaper(rng),
        Surface::Fabric => cloth::fabric(rng),
        Surface::WoodGrain => wood::furniture(rng),
        Surface::Rug => cloth::rug(rng),
        Surface::Poster => posters::poster(rng),
        Surface::Books => fronts::books(rng),
        Surface::Window => outdoors::window(rng),
        Surface::Door => fronts::door(rng),
        Surface::Appliance => fronts::appliance(rng),
        Surface::Screen => posters::screen(rng),
        Surface::Leaves => cloth::leaves(rng),
    };
    canvas.into_texture()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn equal_arguments_give_equal_bytes_and_other_seeds_other_ones() {
        for surface in Surface::ALL {
            let first = draw(surface, 7);
            assert!(first.width.is_power_of_two() && first.height.is_power_of_two(), "{surface:?}");
            assert_eq!(first.rgba.len(), 4 * (first.width * first.height) as usize, "{surface:?}");
            assert_eq!(first, draw(surface, 7), "{surface:?}");
            assert_ne!(first, draw(surface, 8), "{surface:?}");
        }
    }

    #[test]
    fn every_surface_shows_something_to_a_camera() {
        for surface in Surface::ALL {
            let texture = draw(surface, 3);
            let colours: BTreeSet<&[u8]> = texture.rgba.chunks_exact(4).collect();
            assert!(colours.len() > 20, "{surface:?}: {} colours", colours.len());
        }
    }

    #[test]
    fn repeating_surfaces_have_no_seam() {
        for surface in Surface::ALL.into_iter().filter(|s| s.side_m() > 0.0) {
            let texture = draw(surface, 5);
            let (w, h) = (texture.width as usize, texture.height as usize);
            let luma = |x: usize, y: usize| i64::from(texture.rgba[4 * ((y % h) * w + x % w) + 1]);
            let step = |x: usize| (0..h).map(|y| (luma(x + 1, y) - luma(x, y)).abs()).sum::<i64>();
            let inside = (0..w - 1).map(step).max().unwrap_or(0);
            assert!(step(w - 1) <= inside + h as i64, "{surface:?}: {} at the seam, {inside} inside", step(w - 1));
        }
    }
}
