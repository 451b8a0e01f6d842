//! Cross-sections by shape (PBARL, PBEAML): area, second moments, torsion constant, shear factors.
//!
//! y points up and z to the right in the figures of the Nastran quick reference guide, from where the dimensions
//! are taken. Sections of straight walls are cut into rectangles: A, I1, I2, I12 are exact for them. Torsion constants:
//! circles exact; solid rectangle after Roark (table 10.7, case 4); open walls as the sum of b t³ / 3; closed boxes
//! after Bredt. Shear factors: 5/6 for the rectangle, 0.9 for the circle, 0.5 for the thin tube, otherwise the area of
//! the walls along the shear divided by the whole.

use std::f64::consts::PI;

/// A rectangle of a section: centre (y, z), height along y, width along z.
#[derive(Debug, Clone, Copy)]
struct Rect {
    y: f64,
    z: f64,
    h: f64,
    w: f64,
}

fn rect(y: f64, z: f64, h: f64, w: f64) -> Rect {
    Rect { y, z, h, w }
}

/// What a beam needs of its section, units of the dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// Area.
    pub a: f64,
    /// ∫ y² dA about the centroid: bending in plane 1.
    pub i1: f64,
    /// ∫ z² dA about the centroid: bending in plane 2.
    pub i2: f64,
    /// ∫ y z dA.
    pub i12: f64,
    /// Torsion constant.
    pub j: f64,
    /// Shear factor of plane 1.
    pub k1: f64,
    /// Shear factor of plane 2.
    pub k2: f64,
    /// Centroid relative to the shear centre (y, z); `None` where it is not known here.
    pub neutral_axis: Option<[f64; 2]>,
}

/// A supported shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    name: &'static str,
    n_dims: usize,
}

const SHAPES: [Shape; 19] = [
    Shape { name: "ROD", n_dims: 1 },
    Shape { name: "TUBE", n_dims: 2 },
    Shape { name: "TUBE2", n_dims: 2 },
    Shape { name: "BAR", n_dims: 2 },
    Shape { name: "BOX", n_dims: 4 },
    Shape { name: "BOX1", n_dims: 6 },
    Shape { name: "I", n_dims: 6 },
    Shape { name: "I1", n_dims: 4 },
    Shape { name: "H", n_dims: 4 },
    Shape { name: "T", n_dims: 4 },
    Shape { name: "T1", n_dims: 4 },
    Shape { name: "T2", n_dims: 4 },
    Shape { name: "L", n_dims: 4 },
    Shape { name: "CHAN", n_dims: 4 },
    Shape { name: "CHAN1", n_dims: 4 },
    Shape { name: "CHAN2", n_dims: 4 },
    Shape { name: "Z", n_dims: 4 },
    Shape { name: "HAT", n_dims: 4 },
    Shape { name: "CROSS", n_dims: 4 },
];

impl Shape {
    /// Shape by its name in capitals.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        SHAPES.into_iter().find(|shape| shape.name == name)
    }

    /// Names of all supported shapes.
    #[must_use]
    pub fn names() -> String {
        SHAPES.map(|shape| shape.name).join(", ")
    }

    /// Number of dimensions DIM1, DIM2, ...
    #[must_use]
    pub fn n_dims(&self) -> usize {
        self.n_dims
    }

    /// Section values from the dimensions.
    ///
    /// # Errors
    /// Says which dimensions do not make a section.
    pub fn values(&self, d: &[f64]) -> Result<Values, String> {
        let shown = || d.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let optional_zero = |k: usize| k == 1 && self.name == "TUBE";
        if d.len() != self.n_dims
            || d.iter().enumerate().any(|(k, &x)| !(x > 0.0 || (x == 0.0 && optional_zero(k))))
        {
            return Err(format!("dimensions {} must be {} positive numbers", shown(), self.n_dims));
        }
        match self.name {
            "ROD" => Ok(round(d[0], 0.0)),
            "TUBE" if d[1] < d[0] => Ok(round(d[0], d[1])),
            "TUBE2" if d[1] <= d[0] => Ok(round(d[0], d[0] - d[1])),
            "TUBE" | "TUBE2" => Err(format!("dimensions {}: the wall is thicker than the radius", shown())),
            "BAR" => Ok(bar(d[0], d[1])),
            _ => {
                let walls = self.walls(d);
                if walls.iter().any(|wall| wall.h <= 0.0 || wall.w <= 0.0) {
                    return Err(format!("dimensions {}: the walls leave no room between them", shown()));
                }
                let mut values = from_walls(&walls);
                if let Some(j) = self.closed_torsion(d) {
                    values.j = j;
                }
                values.neutral_axis = self.shear_centre(d).map(|centre| {
                    let (y, z) = centroid(&walls);
                    [y - centre[0], z - centre[1]]
                });
                Ok(values)
            }
        }
    }

    /// Rectangles without overlap, in coordinates with the origin named at each shape.
    fn walls(&self, d: &[f64]) -> Vec<Rect> {
        match self.name {
            // middle of the box
            "BOX" => box_walls(d[0], d[1], [d[2], d[2], d[3], d[3]]),
            "BOX1" => box_walls(d[0], d[1], [d[2], d[3], d[4], d[5]]),
            // lower edge, web in the middle: height, bottom width, top width, web, bottom thickness, top thickness
            "I" => vec![
                rect(d[4] / 2.0, 0.0, d[4], d[1]),
                rect((d[4] + d[0] - d[5]) / 2.0, 0.0, d[0] - d[4] - d[5], d[3]),
                rect(d[0] - d[5] / 2.0, 0.0, d[5], d[2]),
            ],
            // middle: both outstands together, web, inner height, height
            "I1" => {
                let t = (d[3] - d[2]) / 2.0;
                let y = (d[3] - t) / 2.0;
                vec![rect(-y, 0.0, t, d[0] + d[1]), rect(0.0, 0.0, d[2], d[1]), rect(y, 0.0, t, d[0] + d[1])]
            }
            // middle: crossbar length, both uprights together, height, crossbar thickness
            "H" => {
                let z = (d[0] + d[1] / 2.0) / 2.0;
                vec![
                    rect(0.0, -z, d[2], d[1] / 2.0),
                    rect(0.0, 0.0, d[3], d[0]),
                    rect(0.0, z, d[2], d[1] / 2.0),
                ]
            }
            // middle: both arms together, upright thickness, height, arm thickness
            "CROSS" => {
                let (z, w) = ((d[1] + d[0] / 2.0) / 2.0, d[0] / 2.0);
                vec![rect(0.0, 0.0, d[2], d[1]), rect(0.0, z, d[3], w), rect(0.0, -z, d[3], w)]
            }
            _ => self.open_walls(d),
        }
    }

    /// As [`Self::walls`], for the sections that open to one side.
    fn open_walls(&self, d: &[f64]) -> Vec<Rect> {
        match self.name {
            // lower edge: flange width, height, flange thickness, web thickness; T2 is T upside down
            "T" => vec![
                rect((d[1] - d[2]) / 2.0, 0.0, d[1] - d[2], d[3]),
                rect(d[1] - d[2] / 2.0, 0.0, d[2], d[0]),
            ],
            "T2" => {
                vec![rect(d[2] / 2.0, 0.0, d[2], d[0]), rect((d[1] + d[2]) / 2.0, 0.0, d[1] - d[2], d[3])]
            }
            // left edge of the stem: upright height, stem length, upright thickness, stem thickness
            "T1" => vec![rect(0.0, d[1] / 2.0, d[3], d[1]), rect(0.0, d[1] + d[2] / 2.0, d[0], d[2])],
            // outer corner: width, height, thickness of the lying leg, of the standing leg
            "L" => vec![
                rect(d[2] / 2.0, d[0] / 2.0, d[2], d[0]),
                rect((d[1] + d[2]) / 2.0, d[3] / 2.0, d[1] - d[2], d[3]),
            ],
            // back of the web, half height: flange width, height, web thickness, flange thickness
            "CHAN" => {
                let (y, w) = ((d[1] - d[3]) / 2.0, d[0] - d[2]);
                let z = d[2] + w / 2.0;
                vec![rect(0.0, d[2] / 2.0, d[1], d[2]), rect(y, z, d[3], w), rect(-y, z, d[3], w)]
            }
            // as CHAN: outstand, web thickness, inner height, height
            "CHAN1" => {
                let t = (d[3] - d[2]) / 2.0;
                let (y, z) = ((d[3] - t) / 2.0, d[1] + d[0] / 2.0);
                vec![rect(0.0, d[1] / 2.0, d[3], d[1]), rect(y, z, t, d[0]), rect(-y, z, t, d[0])]
            }
            // open end of the legs: leg thickness, back thickness, leg height, width
            "CHAN2" => {
                let z = (d[3] - d[0]) / 2.0;
                vec![
                    rect(d[2] / 2.0, -z, d[2], d[0]),
                    rect(d[2] - d[1] / 2.0, 0.0, d[1], d[3] - 2.0 * d[0]),
                    rect(d[2] / 2.0, z, d[2], d[0]),
                ]
            }
            // middle, upper flange towards -z: outstand, web thickness, inner height, height
            "Z" => {
                let t = (d[3] - d[2]) / 2.0;
                let (y, z) = ((d[3] - t) / 2.0, (d[0] + d[1]) / 2.0);
                vec![rect(y, -z, t, d[0]), rect(0.0, 0.0, d[3], d[1]), rect(-y, z, t, d[0])]
            }
            // HAT, lower edge: height, thickness, width of the top, outstand of each brim
            _ => {
                let (h, z) = (d[0] - d[1], (d[2] - d[1]) / 2.0);
                let brim = (d[2] + d[3]) / 2.0;
                vec![
                    rect(d[0] - d[1] / 2.0, 0.0, d[1], d[2]),
                    rect(h / 2.0, -z, h, d[1]),
                    rect(h / 2.0, z, h, d[1]),
                    rect(d[1] / 2.0, -brim, d[1], d[3]),
                    rect(d[1] / 2.0, brim, d[1], d[3]),
                ]
            }
        }
    }

    /// Bredt: J = 4 Am² / ∮ ds / t, on the centre lines of the walls.
    fn closed_torsion(&self, d: &[f64]) -> Option<f64> {
        let [top, bottom, left, right] = match self.name {
            "BOX" => [d[2], d[2], d[3], d[3]],
            "BOX1" => [d[2], d[3], d[4], d[5]],
            _ => return None,
        };
        let (b, h) = (d[0] - (left + right) / 2.0, d[1] - (top + bottom) / 2.0);
        Some(4.0 * (b * h).powi(2) / (b / top + b / bottom + h / left + h / right))
    }

    /// Shear centre in the coordinates of [`Self::walls`]; `None` where no simple rule gives it.
    fn shear_centre(&self, d: &[f64]) -> Option<[f64; 2]> {
        match self.name {
            "BOX" | "I1" | "H" | "CROSS" | "Z" => Some([0.0; 2]),
            // between the flanges' centre lines, shared by their stiffnesses in plane 2
            "I" => {
                let (bottom, top) = (d[4] * d[1].powi(3), d[5] * d[2].powi(3));
                let (low, high) = (d[4] / 2.0, d[0] - d[5] / 2.0);
                Some([low + (high - low) * top / (bottom + top), 0.0])
            }
            // where the centre lines meet
            "T" => Some([d[1] - d[2] / 2.0, 0.0]),
            "T2" => Some([d[2] / 2.0, 0.0]),
            "T1" => Some([0.0, d[1] + d[2] / 2.0]),
            "L" => Some([d[2] / 2.0, d[3] / 2.0]),
            _ => None,
        }
    }
}

fn box_walls(width: f64, height: f64, [top, bottom, left, right]: [f64; 4]) -> Vec<Rect> {
    let h = height - top - bottom;
    let y = (bottom - top) / 2.0;
    vec![
        rect((height - top) / 2.0, 0.0, top, width),
        rect(-(height - bottom) / 2.0, 0.0, bottom, width),
        rect(y, -(width - left) / 2.0, h, left),
        rect(y, (width - right) / 2.0, h, right),
    ]
}

fn round(outer: f64, inner: f64) -> Values {
    let i = PI / 4.0 * (outer.powi(4) - inner.powi(4));
    let k = if inner > 0.0 { 0.5 } else { 0.9 };
    let a = PI * (outer * outer - inner * inner);
    Values { a, i1: i, i2: i, i12: 0.0, j: 2.0 * i, k1: k, k2: k, neutral_axis: Some([0.0; 2]) }
}

fn bar(width: f64, height: f64) -> Values {
    let (long, short) = (width.max(height), width.min(height));
    let ratio = short / long;
    let j = long * short.powi(3) * (1.0 / 3.0 - 0.21 * ratio * (1.0 - ratio.powi(4) / 12.0));
    Values {
        a: width * height,
        i1: width * height.powi(3) / 12.0,
        i2: height * width.powi(3) / 12.0,
        i12: 0.0,
        j,
        k1: 5.0 / 6.0,
        k2: 5.0 / 6.0,
        neutral_axis: Some([0.0; 2]),
    }
}

fn centroid(walls: &[Rect]) -> (f64, f64) {
    let a: f64 = walls.iter().map(|r| r.h * r.w).sum();
    let y: f64 = walls.iter().map(|r| r.h * r.w * r.y).sum();
    let z: f64 = walls.iter().map(|r| r.h * r.w * r.z).sum();
    (y / a, z / a)
}

fn from_walls(walls: &[Rect]) -> Values {
    let (y, z) = centroid(walls);
    let mut v = Values { a: 0.0, i1: 0.0, i2: 0.0, i12: 0.0, j: 0.0, k1: 0.0, k2: 0.0, neutral_axis: None };
    for r in walls {
        let a = r.h * r.w;
        v.a += a;
        v.i1 += a * (r.h * r.h / 12.0 + (r.y - y).powi(2));
        v.i2 += a * (r.w * r.w / 12.0 + (r.z - z).powi(2));
        v.i12 += a * (r.y - y) * (r.z - z);
        v.j += r.h.max(r.w) * r.h.min(r.w).powi(3) / 3.0;
        if r.h >= r.w {
            v.k1 += a;
        } else {
            v.k2 += a;
        }
    }
    v.k1 /= v.a;
    v.k2 /= v.a;
    v
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn values(name: &str, d: &[f64]) -> Values {
        Shape::from_name(name).unwrap().values(d).unwrap()
    }

    #[test]
    fn a_box_is_the_difference_of_two_bars() {
        let v = values("BOX", &[40.0, 60.0, 3.0, 2.0]);
        let (outer, inner) = (values("BAR", &[40.0, 60.0]), values("BAR", &[36.0, 54.0]));
        assert_relative_eq!(v.a, outer.a - inner.a, max_relative = 1e-12);
        assert_relative_eq!(v.i1, outer.i1 - inner.i1, max_relative = 1e-12);
        assert_relative_eq!(v.i2, outer.i2 - inner.i2, max_relative = 1e-12);
        // Roark table 10.7 case 16
        let (b, h) = (38.0_f64, 57.0_f64);
        let j = 2.0 * 3.0 * 2.0 * (b * h).powi(2) / (40.0 * 2.0 + 60.0 * 3.0 - 4.0 - 9.0);
        assert_relative_eq!(v.j, j, max_relative = 1e-12);
    }

    #[test]
    fn shapes_that_are_the_same_in_two_ways_agree() {
        let i = values("I", &[100.0, 50.0, 50.0, 6.0, 8.0, 8.0]);
        let i1 = values("I1", &[44.0, 6.0, 84.0, 100.0]);
        let h = values("H", &[84.0, 16.0, 50.0, 6.0]);
        assert_relative_eq!(i.a, i1.a, max_relative = 1e-12);
        assert_relative_eq!(i.i1, i1.i1, max_relative = 1e-12);
        assert_relative_eq!(i.i2, i1.i2, max_relative = 1e-12);
        assert_relative_eq!(i.i1, h.i2, max_relative = 1e-12);
        assert_relative_eq!(i.i2, h.i1, max_relative = 1e-12);
        let (c, c1) = (values("CHAN", &[50.0, 100.0, 6.0, 8.0]), values("CHAN1", &[44.0, 6.0, 84.0, 100.0]));
        assert_relative_eq!(c.i1, c1.i1, max_relative = 1e-12);
        assert_relative_eq!(c.i2, c1.i2, max_relative = 1e-12);
        assert_relative_eq!(c.i1, i.i1, max_relative = 1e-12);
        let (t, t2) = (values("T", &[50.0, 100.0, 8.0, 6.0]), values("T2", &[50.0, 100.0, 8.0, 6.0]));
        assert_relative_eq!(t.i1, t2.i1, max_relative = 1e-12);
        let (n, n2) = (t.neutral_axis.unwrap(), t2.neutral_axis.unwrap());
        assert_relative_eq!(n[0], -n2[0], max_relative = 1e-12);
        assert!(n[0] < 0.0);
    }

    #[test]
    fn a_thick_tube_becomes_a_rod_and_dimensions_are_checked() {
        let (tube, rod) = (values("TUBE", &[2.0, 0.0]), values("ROD", &[2.0]));
        assert_eq!((tube.a, tube.i1, tube.j), (rod.a, rod.i1, rod.j));
        assert_relative_eq!(values("TUBE2", &[2.0, 0.5]).i1, values("TUBE", &[2.0, 1.5]).i1);
        assert_relative_eq!(values("BAR", &[1.0, 1.0]).j, 0.1408, max_relative = 1e-3);
        for (name, d) in [("ROD", vec![-1.0]), ("TUBE", vec![1.0, 2.0]), ("BOX", vec![1.0, 1.0, 0.6, 0.1])] {
            assert!(Shape::from_name(name).unwrap().values(&d).is_err(), "{name}");
        }
    }

    #[test]
    fn a_z_is_an_i_with_half_of_each_flange_moved_across() {
        let (z, i) = (values("Z", &[44.0, 6.0, 84.0, 100.0]), values("I1", &[44.0, 6.0, 84.0, 100.0]));
        assert_relative_eq!(z.a, i.a, max_relative = 1e-12);
        assert_relative_eq!(z.i1, i.i1, max_relative = 1e-12);
        // two flanges of 44 x 8 at y = +-46, z = -+25
        assert_relative_eq!(z.i12, -2.0 * 44.0 * 8.0 * 46.0 * 25.0, max_relative = 1e-12);
    }

    #[test]
    fn a_hat_without_brims_to_speak_of_is_a_channel_on_its_side() {
        let (hat, chan2) =
            (values("HAT", &[50.0, 3.0, 40.0, 1e-9]), values("CHAN2", &[3.0, 3.0, 50.0, 40.0]));
        assert_relative_eq!(hat.a, chan2.a, max_relative = 1e-9);
        assert_relative_eq!(hat.i1, chan2.i1, max_relative = 1e-9);
        assert_relative_eq!(hat.i2, chan2.i2, max_relative = 1e-9);
        assert_relative_eq!(values("HAT", &[50.0, 3.0, 40.0, 20.0]).a, 522.0, max_relative = 1e-12);
    }

    #[test]
    fn an_angle_has_a_product_of_inertia() {
        // equal legs: principal axes at 45 degrees, I1 = I2, I12 < 0 for legs along +y and +z
        let l = values("L", &[50.0, 50.0, 5.0, 5.0]);
        assert_relative_eq!(l.i1, l.i2, max_relative = 1e-12);
        assert!(l.i12 < 0.0 && l.i12.abs() < l.i1);
    }
}
