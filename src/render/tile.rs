//! The image as tiles: units of work, of batches and of coherence.

use super::sampler::mix;

/// Width and height of a tile in pixels.
pub const TILE_SIZE: u32 = 8;
/// Pixels of a whole tile.
pub const TILE_PIXELS: usize = (TILE_SIZE * TILE_SIZE) as usize;

/// An image cut into tiles, numbered row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    size: [u32; 2],
}

/// One tile: the pixels from `start` to before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Column and row of the first pixel.
    pub start: [u32; 2],
    /// Column and row after the last pixel: at most [`TILE_SIZE`] further.
    pub end: [u32; 2],
}

/// In which order tiles are taken. Images do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TileOrder {
    /// Along Morton's curve, so that neighbours in time look at the same things.
    #[default]
    Morton,
    /// Row by row.
    Scanline,
    /// Row by row from the end.
    Reverse,
    /// Any order, from a seed.
    Shuffled(u64),
}

impl TileGrid {
    /// The tiles of an image of `size` pixels.
    pub fn new(size: [u32; 2]) -> Self {
        Self { size }
    }

    /// Width and height of the image in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Number of tiles.
    pub fn len(&self) -> usize {
        let [columns, rows] = self.size.map(|n| n.div_ceil(TILE_SIZE) as usize);
        columns * rows
    }

    /// Whether there is no tile.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Tile `index`.
    pub fn tile(&self, index: usize) -> Tile {
        let columns = self.size[0].div_ceil(TILE_SIZE) as usize;
        let start = [(index % columns) as u32, (index / columns) as u32].map(|n| n * TILE_SIZE);
        let end = [0, 1].map(|axis| (start[axis] + TILE_SIZE).min(self.size[axis]));
        Tile { start, end }
    }

    /// All tile indices in the given order.
    pub fn order(&self, order: TileOrder) -> Vec<u32> {
        let mut tiles: Vec<u32> = (0..self.len() as u32).collect();
        match order {
            TileOrder::Scanline => {}
            TileOrder::Reverse => tiles.reverse(),
            TileOrder::Shuffled(seed) => {
                tiles.sort_by_cached_key(|&tile| mix(mix(seed) ^ u64::from(tile)));
            }
            TileOrder::Morton => tiles.sort_by_cached_key(|&tile| {
                let [x, y] = self.tile(tile as usize).start;
                spread(x) | spread(y) << 1
            }),
        }
        tiles
    }
}

impl Tile {
    /// The pixels, row by row: the slot in the tile, below [`TILE_PIXELS`], with column and row.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, [u32; 2])> + use<> {
        let Self { start, end } = *self;
        (start[1]..end[1]).flat_map(move |y| {
            (start[0]..end[0]).map(move |x| {
                let slot = (y - start[1]) * TILE_SIZE + (x - start[0]);
                (slot as usize, [x, y])
            })
        })
    }

    /// Column and row of the pixel in `slot`.
    pub fn pixel(&self, slot: usize) -> [u32; 2] {
        let slot = slot as u32;
        [self.start[0] + slot % TILE_SIZE, self.start[1] + slot / TILE_SIZE]
    }
}

/// The bits of a word with a gap after each.
fn spread(word: u32) -> u64 {
    (0..32).fold(0, |spread, bit| spread | u64::from(word >> bit & 1) << (2 * bit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for size in [[1, 1], [8, 8], [9, 7], [30, 17]] {
            let grid = TileGrid::new(size);
            let mut seen = vec![0; (size[0] * size[1]) as usize];
            for tile in (0..grid.len()).map(|index| grid.tile(index)) {
                for (slot, [x, y]) in tile.pixels() {
                    assert!(slot < TILE_PIXELS);
                    assert_eq!(tile.pixel(slot), [x, y]);
                    seen[(y * size[0] + x) as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{size:?}");
        }
    }

    #[test]
    fn orders_are_permutations() {
        let grid = TileGrid::new([40, 24]);
        let scanline = grid.order(TileOrder::Scanline);
        let orders = [TileOrder::Morton, TileOrder::Reverse, TileOrder::Shuffled(3)];
        for order in orders.map(|order| grid.order(order)) {
            assert_ne!(order, scanline);
            let mut sorted = order;
            sorted.sort_unstable();
            assert_eq!(sorted, scanline);
        }
        assert_eq!(&grid.order(TileOrder::Morton)[..5], [0, 1, 5, 6, 2]);
    }
}
