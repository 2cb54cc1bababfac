//! Which layers a film has, and what each is made of.

use super::plan::ClassPlan;
use super::settings::{Pass, RayClass};
use crate::{Error, Result};

/// What the layer without a name is called where layers are chosen.
pub(super) const PICTURE: &str = "picture";

/// What a layer shows. Classes are those of the plan, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    Picture,
    Shadow,
    Class(usize),
    Irradiance,
    Depth,
    Normal,
    Samples(usize),
    Nodes,
}

impl Content {
    pub(super) fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Picture => &["R", "G", "B", "A"],
            Self::Irradiance => &["R", "G", "B"],
            Self::Depth => &["Z"],
            Self::Normal => &["X", "Y", "Z"],
            Self::Shadow | Self::Class(_) | Self::Samples(_) | Self::Nodes => &["Y"],
        }
    }

    /// The value where no surface is seen.
    pub(super) fn background(self) -> f32 {
        if self == Self::Depth { f32::INFINITY } else { 0.0 }
    }
}

/// A layer of the film under way.
#[derive(Clone, Debug)]
pub(super) struct LayerPlan {
    pub(super) name: String,
    pub(super) content: Content,
    /// Whether it is in the film when that is done: the picture is made from others.
    pub(super) is_kept: bool,
}

/// What is made of all that could be.
#[derive(Clone, Debug, Default)]
pub(super) struct Choice {
    pub(super) layers: Vec<LayerPlan>,
    /// Names of the layers that are not.
    pub(super) left_out: Vec<String>,
    /// Channels of those.
    pub(super) channels_left_out: usize,
    /// Names of the classes that no layer needs.
    pub(super) classes_left_out: Vec<String>,
}

/// Keeps of `classes` those that the layers called `asked` are made of, all without any such list,
/// and says which layers are made.
pub(super) fn choose(
    classes: &mut Vec<ClassPlan>,
    is_adaptive: bool,
    asked: Option<&[String]>,
) -> Result<Choice> {
    let possible = possible(classes, is_adaptive);
    let called = |name: &str| if name.is_empty() { PICTURE.to_owned() } else { name.to_owned() };
    for name in asked.unwrap_or_default() {
        if !possible.iter().any(|(layer, _)| called(layer) == *name) {
            let names: Vec<_> = possible.iter().map(|(layer, _)| called(layer)).collect();
            let names = names.join(", ");
            return Err(Error::Usage(format!("no layer {name:?}: choose from {names}")));
        }
    }
    if asked.is_some_and(<[String]>::is_empty) {
        return Err(Error::Usage("no layer to make".into()));
    }
    let is_asked = |name: &str| asked.is_none_or(|asked| asked.contains(&called(name)));
    let makes_picture = is_asked("");
    let ambient = ambient_of_picture(classes);
    let is_needed = |name: &str, content: Content| {
        is_asked(name)
            || makes_picture
                && (content == Content::Irradiance
                    || ambient.is_some_and(|class| content == Content::Class(class)))
    };
    let mut choice = Choice::default();
    for (name, content) in possible {
        let is_kept = is_asked(&name);
        if !is_kept {
            choice.left_out.push(called(&name));
            choice.channels_left_out += content.channels().len();
        }
        if is_needed(&name, content) {
            choice.layers.push(LayerPlan { name, content, is_kept });
        }
    }
    let needs = |class: usize, plan: &ClassPlan| {
        choice.layers.iter().any(|layer| match layer.content {
            Content::Class(of) | Content::Samples(of) => of == class,
            Content::Shadow | Content::Irradiance => plan.class.pass() == Pass::Shadow,
            _ => false,
        })
    };
    let needed: Vec<bool> = classes.iter().enumerate().map(|(i, plan)| needs(i, plan)).collect();
    let place = |class: usize| needed[..class].iter().filter(|&&needed| needed).count();
    for layer in &mut choice.layers {
        match &mut layer.content {
            Content::Class(class) | Content::Samples(class) => *class = place(*class),
            _ => {}
        }
    }
    let mut is_needed = needed.iter();
    classes.retain(|class| {
        let needed = is_needed.next() == Some(&true);
        if !needed {
            choice.classes_left_out.push(class.name.clone());
        }
        needed
    });
    Ok(choice)
}

/// All layers that there can be of such classes, in the order of files.
fn possible(classes: &[ClassPlan], is_adaptive: bool) -> Vec<(String, Content)> {
    let has_shadows = classes.iter().any(|class| class.class.pass() == Pass::Shadow);
    let mut layers = vec![(String::new(), Content::Picture)];
    if has_shadows {
        layers.push(("shadow".into(), Content::Shadow));
    }
    let of_classes = classes.iter().enumerate();
    layers.extend(of_classes.map(|(index, class)| (class.name.clone(), Content::Class(index))));
    if has_shadows {
        layers.push(("irradiance".into(), Content::Irradiance));
    }
    layers.push(("depth".into(), Content::Depth));
    layers.push(("normal".into(), Content::Normal));
    if is_adaptive {
        let varying = classes.iter().enumerate().filter(|(_, class)| class.samples_differ);
        layers.extend(
            varying.map(|(i, class)| (format!("samples.{}", class.name), Content::Samples(i))),
        );
    }
    layers
}

/// The class whose visibility attenuates the picture's ambient light.
pub(super) fn ambient_of_picture(classes: &[ClassPlan]) -> Option<usize> {
    [RayClass::AmbientOcclusion, RayClass::AmbientOcclusionUnbounded]
        .into_iter()
        .find_map(|class| classes.iter().position(|plan| plan.class == class))
}
