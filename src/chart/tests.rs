//! Layout at its edges: nothing, one, much, long, odd.

use super::drawing::{Drawing, HAlign, Item, Place, Text};
use super::*;

const LONG: &str = "bvh2:order=rtsah-approx-clamped,trace=packet,builder=spatial,mode=exact";

fn chart(body: Body) -> Chart {
    Chart {
        title: "Title".into(),
        subtitle: String::new(),
        footnote: "machine; command".into(),
        body,
    }
}

fn bars(values: &[&[f64]]) -> Bars {
    let series = values.iter().map(|v| v.len()).max().unwrap_or(0);
    Bars {
        axis: Axis::linear("time [ms]"),
        series: (0..series).map(|s| format!("series {s}")).collect(),
        groups: values.iter().map(|&v| Group::new("group", v.iter().copied())).collect(),
        ..Bars::default()
    }
}

fn many_bars() -> Bars {
    let value = |g: usize, s: usize| 0.6 + ((7 * g + 5 * s) % 19) as f64 / 10.0;
    Bars {
        axis: Axis::linear("ratio").with_reference(1.0),
        series: (0..16).map(|s| format!("bvh2:order=number-{s}")).collect(),
        groups: (0..13)
            .map(|g| Group::new(format!("scene {g}"), (0..16).map(|s| value(g, s))))
            .collect(),
        better: Better::Higher,
        ..Bars::default()
    }
}

fn table(rows: usize, columns: usize, value: impl Fn(usize, usize) -> f64) -> HeatTable {
    HeatTable {
        axis: Axis::log("ratio").with_reference(1.0),
        rows: (0..rows).map(|r| format!("{LONG}{r}")).collect(),
        columns: (0..columns).map(|c| format!("{LONG} {c}")).collect(),
        values: (0..rows).map(|r| (0..columns).map(|c| value(r, c)).collect()).collect(),
        ..HeatTable::default()
    }
}

fn lines(count: usize) -> Xy {
    Xy {
        x_axis: Axis::log("time [s]"),
        y_axis: Axis::log("error"),
        series: (0..count)
            .map(|s| Series::line(format!("{LONG}{s}"), (1..9).map(|i| [f64::from(i), s as f64])))
            .collect(),
    }
}

/// Charts at the edges of what can be asked for.
fn odd_charts() -> Vec<(&'static str, Chart)> {
    let points = [[0.0, 1.0], [f64::NAN, 2.0], [1.0, f64::INFINITY], [1e-200, 1e200]];
    let xy = |x_axis, y_axis| {
        let series =
            vec![Series::points("points", points), Series::line("line", points.map(Point::from))];
        Body::Xy(Xy { x_axis, y_axis, series })
    };
    let whiskers = [
        Bar { value: 1.0, range: Some([0.5, f64::NAN]) },
        Bar { value: f64::NAN, range: Some([0.5, 2.0]) },
        Bar { value: 2.0, range: Some([1.5, 20.0]) },
    ];
    let mut charts = vec![
        ("no series", Body::Bars(Bars::default())),
        ("no values", Body::Bars(bars(&[&[f64::NAN, f64::INFINITY], &[]]))),
        ("one bar", Body::Bars(bars(&[&[3.0]]))),
        ("zeros", Body::Bars(bars(&[&[0.0, 0.0]]))),
        ("ragged", Body::Bars(bars(&[&[1.0], &[-2.0, f64::NAN, 3.0], &[]]))),
        ("huge range", Body::Bars(bars(&[&[1e-290, 1e290], &[1.0]]))),
        (
            "whiskers",
            Body::Bars(Bars { groups: vec![Group::new("", whiskers)], ..bars(&[&[0.0; 3]]) }),
        ),
        ("16 x 13", Body::Bars(many_bars())),
        ("no lines", Body::Xy(Xy::default())),
        (
            "one point",
            Body::Xy(Xy { series: vec![Series::line("", [[1.0, 1.0]])], ..Xy::default() }),
        ),
        ("points", xy(Axis::linear("x"), Axis::linear("y"))),
        ("log points", xy(Axis::log("x"), Axis::log("y").with_reference(-1.0))),
        ("20 lines", Body::Xy(lines(20))),
        ("no table", Body::HeatTable(HeatTable::default())),
        ("one cell", Body::HeatTable(table(1, 1, |_, _| 1.0))),
        (
            "table",
            Body::HeatTable(table(12, 6, |r, c| if r == c { f64::NAN } else { (r * c) as f64 })),
        ),
        (
            "short table",
            Body::HeatTable(HeatTable { values: vec![vec![2.0]], ..table(3, 3, |_, _| 1.0) }),
        ),
    ]
    .into_iter()
    .map(|(name, body)| (name, chart(body)))
    .collect::<Vec<_>>();
    for layout in [BarLayout::Panels, BarLayout::SideBySide] {
        for axis in [Axis::linear("x"), Axis::log(LONG.repeat(3)).with_reference(1.0)] {
            let names = |i| format!("{LONG} and {i}");
            let many = many_bars();
            let long = Bars {
                axis: axis.clone(),
                series: (0..16).map(names).collect(),
                groups: many.groups.iter().map(|g| Group { name: names(1), ..g.clone() }).collect(),
                layout,
                sorted: true,
                ..many
            };
            charts.push(("long names", chart(Body::Bars(long))));
            let range = Bars { axis, layout, ..bars(&[&[1e-9, 1.0, 1e12], &[0.5, 2.0, f64::NAN]]) };
            charts.push(("ratios", chart(Body::Bars(Bars { own_axes: true, ..range }))));
        }
    }
    let long = "word ".repeat(80) + &"x".repeat(400) + "\u{0}\u{1}<&>\"'";
    charts.push((
        "long texts",
        Chart {
            title: long.clone(),
            subtitle: long.clone(),
            footnote: long,
            body: Body::Bars(bars(&[&[1.0, 2.0]])),
        },
    ));
    charts
}

/// Upper left and lower right corner of a text.
fn bounds(text: &Text) -> [Place; 2] {
    let width = font::width(&text.text, text.size, text.bold);
    let start = match text.align {
        HAlign::Left => 0.0,
        HAlign::Centre => -0.5 * width,
        HAlign::Right => -width,
    };
    let (end, half, [x, y]) = (start + width, 0.55 * text.size, text.at);
    if text.upwards {
        [[x - half, y - end], [x + half, y - start]]
    } else {
        [[x + start, y - half], [x + end, y + half]]
    }
}

/// Boxes of all texts, a little smaller than they are, as neighbours may touch.
fn text_boxes(page: &Drawing) -> Vec<(&str, [Place; 2])> {
    let texts = page.items.iter().filter_map(|item| match item {
        Item::Text(text) => Some(text),
        _ => None,
    });
    texts
        .map(|text| {
            let [[x0, y0], [x1, y1]] = bounds(text);
            (text.text.as_str(), [[x0 + 0.5, y0 + 1.0], [x1 - 0.5, y1 - 1.0]])
        })
        .collect()
}

#[test]
fn texts_are_on_the_page_and_apart() {
    for (name, chart) in odd_charts() {
        let page = chart.page();
        let boxes = text_boxes(&page);
        assert!(!boxes.is_empty(), "{name}");
        for (at, (text, [from, to])) in boxes.iter().enumerate() {
            let inside =
                from.iter().all(|&v| v >= 0.0) && to[0] <= page.size[0] && to[1] <= page.size[1];
            assert!(inside, "{name}: {text:?} is off the page");
            for (other, [other_from, other_to]) in &boxes[at + 1..] {
                let apart = (0..2).any(|i| to[i] <= other_from[i] || other_to[i] <= from[i]);
                assert!(apart, "{name}: {text:?} and {other:?} overlap");
            }
        }
    }
}

#[test]
fn shapes_are_on_the_page_and_finite() {
    for (name, chart) in odd_charts() {
        let page = chart.page();
        let check = |[x, y]: Place| {
            let inside = (-1.0..=page.size[0] + 1.0).contains(&x)
                && (-1.0..=page.size[1] + 1.0).contains(&y);
            assert!(inside, "{name}: {x}, {y} on {:?}", page.size);
        };
        for item in &page.items {
            match item {
                Item::Rect { from, to, .. } | Item::Line { from, to, .. } => {
                    [*from, *to].into_iter().for_each(check);
                }
                Item::Polygon { points, .. } => points.iter().for_each(|&p| check(p)),
                Item::Disk { centre, .. } => check(*centre),
                Item::Text(text) => check(text.at),
            }
        }
    }
}

#[test]
fn charts_without_data_say_so() {
    for (name, chart) in odd_charts().into_iter().filter(|(name, _)| name.starts_with("no ")) {
        let page = chart.page();
        assert!(text_boxes(&page).iter().any(|(text, _)| *text == "no data to show"), "{name}");
    }
}

/// Tags are closed in order, attributes are quoted, and text is escaped.
fn check_xml(text: &str) {
    let mut open = Vec::new();
    for part in text.split('<').skip(1) {
        let (tag, rest) = part.split_once('>').expect("tags end");
        let rest = rest.replace("&lt;", "").replace("&gt;", "").replace("&amp;", "");
        let rest = rest.replace("&quot;", "").replace("&apos;", "");
        assert!(!rest.contains(['&', '>', '\0', '\u{1}']), "{rest:?}");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn files_are_whole_and_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    for (index, (name, chart)) in odd_charts().into_iter().enumerate() {
        let page = chart.page();
        assert!(page.size[0] * page.size[1] < 8e6, "{name}: {:?}", page.size);
        let once = chart.write(&folder.path().join(format!("new/{index}.a"))).unwrap();
        let again = chart.write(&folder.path().join(format!("new/{index}.b"))).unwrap();
        assert!(once[0].ends_with(format!("new/{index}.a.png")), "{once:?}");
        for (a, b) in once.iter().zip(&again) {
            assert_eq!(std::fs::read(a).unwrap(), std::fs::read(b).unwrap(), "{name}");
        }
        let svg = std::fs::read_to_string(&once[1]).unwrap();
        check_xml(&svg);
        let [width, height] = page.size;
        assert!(svg.starts_with(&format!("<svg width=\"{width}\" height=\"{height}\" viewBox")));
        assert!(svg.contains("font-family=\"DejaVu Sans, Verdana, sans-serif\""), "{name}");
        let image = image::open(&once[0]).unwrap().to_rgb8();
        let [width, height] = page.size.map(|length| length as u32);
        let density = if width * height > 4_000_000 { 1 } else { 2 };
        assert_eq!(image.dimensions(), (density * width, density * height), "{name}");
        assert_eq!(image.get_pixel(0, 0).0, [255; 3], "{name}");
        assert!(image.pixels().any(|p| p.0 != [255; 3]), "{name}");
    }
}

#[test]
fn a_bar_stands_where_its_value_is() {
    let bars = Bars { layout: BarLayout::SideBySide, ..bars(&[&[1.0, 2.0, f64::NAN, 4.0]]) };
    let page = chart(Body::Bars(bars)).page();
    let height = |series: usize| {
        let colour = palette::Look::of(series).colour;
        page.items.iter().find_map(|item| match item {
            Item::Rect { from, to, colour: c } if *c == colour => Some(to[1] - from[1]),
            _ => None,
        })
    };
    // The first rectangle of a colour is its bar: the legend comes later.
    let [one, two, four] = [0, 1, 3].map(|series| height(series).unwrap());
    assert!((two / one - 2.0).abs() < 1e-9 && (four / one - 4.0).abs() < 1e-9);
}

#[test]
fn the_best_series_come_first() {
    let sorted = Bars {
        better: Better::Lower,
        sorted: true,
        layout: BarLayout::Panels,
        ..bars(&[
            &[3.0, 1.0, f64::NAN, 2.0],
            &[30.0, 10.0, f64::NAN, 20.0],
            &[0.1, 0.2, f64::NAN, 0.3],
        ])
    };
    let page = chart(Body::Bars(sorted)).page();
    let boxes = text_boxes(&page);
    let mut names: Vec<_> = boxes.iter().filter(|(t, _)| t.starts_with("series")).collect();
    names.sort_by(|a, b| a.1[0][1].total_cmp(&b.1[0][1]));
    let names: Vec<&str> = names.iter().map(|n| n.0).collect();
    assert_eq!(names, ["series 1", "series 3", "series 0", "series 2"]);
}

#[test]
fn charts_that_are_too_large_are_refused() {
    let groups = (0..3000).map(|g| Group::new(format!("{g}"), [1.0])).collect();
    let folder = tempfile::tempdir().unwrap();
    let bars = Bars { layout: BarLayout::SideBySide, groups, ..bars(&[&[1.0]]) };
    let error = chart(Body::Bars(bars)).write(&folder.path().join("x")).unwrap_err().to_string();
    assert!(error.contains("x.png") && error.contains("too large"), "{error}");
    assert!(!error.contains('\n') && !folder.path().join("x.svg").exists());
}

/// Pixels are where they should be, and what is absent leaves its place empty.
#[test]
fn pictures_lie_in_columns() {
    let picture = |size: [u32; 2]| {
        let pixels = (0..size[0] * size[1]).map(|i| [(i % 7) as u8; 3]).collect();
        Some(Picture { size, pixels, caption: vec!["1 sample".into()] })
    };
    let pictures = Pictures {
        columns: vec!["one".into(), LONG.into(), "three".into()],
        rows: vec![PictureRow {
            title: "row".into(),
            pictures: vec![picture([8, 6]), None, picture([2, 2])],
        }],
        zoom: 3,
    };
    let drawing = pictures.draw();
    let dots = drawing.items.iter().filter_map(|item| match item {
        Item::Rect { from, to, .. } => Some((*from, *to)),
        _ => None,
    });
    let dots: Vec<(Place, Place)> = dots.collect();
    assert_eq!(dots.len(), 48 + 4);
    let area: f64 = dots.iter().map(|(a, b)| (b[0] - a[0]) * (b[1] - a[1])).sum();
    assert!((area - 9.0 * 52.0).abs() < 1e-6, "{area}");
    assert!(dots.iter().all(|(_, b)| b[0] <= drawing.size[0] && b[1] <= drawing.size[1]));
    let folder = tempfile::tempdir().unwrap();
    let path = chart(Body::Pictures(pictures)).write_png(&folder.path().join("x.y")).unwrap();
    assert!(path.ends_with("x.y.png") && path.exists());
    assert_eq!(Pictures::default().draw().size, [0.0, 1.0]);
}
