//! The cases: one file for each family, one line for each case.

mod closed;
mod degenerate;
mod extreme;
mod far;
mod interval;
mod planes;
mod scaled;
mod slivers;
mod soup;

use super::Random;
use crate::Result;
use crate::geometry::TriangleMesh;
use crate::ray::Ray;

/// A nasty kind of geometry or rays.
pub struct CaseEntry {
    /// As typed after `--case`.
    pub name: &'static str,
    /// What is nasty, in a line.
    pub about: &'static str,
    /// Makes it from the seed: one stage, or several that differ in scale or place.
    ///
    /// # Errors
    /// If a stage goes through a file that cannot be written.
    pub stages: fn(seed: u64) -> Result<Vec<Stage>>,
}

/// A mesh and the rays for it.
pub struct Stage {
    /// What sets it apart from the other stages of its case, as part of a file name; may be empty.
    pub label: String,
    /// The triangles.
    pub mesh: TriangleMesh,
    /// Makes a ray.
    pub ray: RaySource,
    /// Most rays to give it: few where each meets very many triangles.
    pub most_rays: u64,
}

/// Makes a ray for the mesh.
pub type RaySource = Box<dyn Fn(&TriangleMesh, &mut Random) -> Ray + Send + Sync>;

impl Stage {
    /// The only stage of a case.
    fn only(
        mesh: TriangleMesh,
        ray: impl Fn(&TriangleMesh, &mut Random) -> Ray + Send + Sync + 'static,
    ) -> Vec<Self> {
        vec![Self::new(String::new(), mesh, ray)]
    }

    fn new(
        label: impl Into<String>,
        mesh: TriangleMesh,
        ray: impl Fn(&TriangleMesh, &mut Random) -> Ray + Send + Sync + 'static,
    ) -> Self {
        Self { label: label.into(), mesh, ray: Box::new(ray), most_rays: u64::MAX }
    }
}

impl std::fmt::Debug for CaseEntry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// All cases, in the order in which they run.
pub static CASES: &[&CaseEntry] = &[
    &soup::SOUP,
    &closed::ICOSPHERE,
    &closed::CUBE,
    &closed::TESSELLATED_BOX,
    &closed::TORUS,
    &planes::FACE_PLANES,
    &planes::TRIANGLE_PLANES,
    &planes::SLAB_PLANES,
    &scaled::BY_TWO,
    &scaled::BY_TEN,
    &far::MILLION,
    &far::EMBREE_VERIFY,
    &slivers::SLIVER_SOUP,
    &slivers::SLIVER_SPHERE,
    &degenerate::DUPLICATES,
    &degenerate::ZERO_AREA,
    &degenerate::COINCIDENT,
    &degenerate::DEEP_TREE,
    &extreme::DENORMALS,
    &extreme::HUGE,
    &extreme::DIRECTION_LENGTHS,
    &extreme::NON_FINITE_RAYS,
    &extreme::NON_FINITE_VERTICES,
    &interval::INTERVAL_ENDS,
    &interval::EXACT_ENDS,
];

/// The case called `name`.
pub fn find(name: &str) -> Option<&'static CaseEntry> {
    CASES.iter().copied().find(|case| case.name == name)
}
