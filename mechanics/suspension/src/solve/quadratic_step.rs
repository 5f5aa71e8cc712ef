//! Exact solution of the step of one iteration: a convex quadratic program over a box and half planes, in one or
//! two variables.
//!
//! ```text
//!     minimise g.d + 1/2 d'H d    over -1 <= z + d <= 1,  m_j + dm_j.d >= 0
//! ```
//! The optimum is the minimum of the objective on one, two or none of the constraints taken as equations. These
//! sets are few, so all are tried: the work is fixed, and the only rounding is that of solving two equations.

use crate::cost::{Evaluation, MAX_MARGINS};

/// Constraint tolerance, relative to the gradient.
const ROUNDING: f64 = 1e-12;
/// A point within this distance of a side of the box counts as on it.
const AT_SIDE: f64 = 1e-12;
/// Smallest curvature, relative to the largest.
const LEAST_CURVATURE_SHARE: f64 = 1e-12;

/// A step, and the Lagrange multipliers of the margins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step<const N: usize> {
    pub(crate) d: [f64; N],
    pub(crate) multipliers: [f64; MAX_MARGINS],
}

/// `normal.d >= least`
#[derive(Debug, Clone, Copy)]
struct Row<const N: usize> {
    normal: [f64; N],
    least: f64,
    /// The margin it belongs to; `None` for a side of the box.
    margin: Option<usize>,
}

const MAX_ROWS: usize = 4 + MAX_MARGINS;

/// Gradient and Hessian of the objective.
struct Objective<const N: usize> {
    g: [f64; N],
    h: [[f64; N]; N],
}

impl<const N: usize> Objective<N> {
    fn at(&self, d: &[f64; N]) -> f64 {
        (0..N)
            .map(|i| d[i] * (self.g[i] + 0.5 * dot(&self.h[i], d)))
            .sum()
    }

    /// g + H d
    fn gradient(&self, d: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| self.g[i] + dot(&self.h[i], d))
    }

    /// H^-1 v
    fn solve(&self, v: &[f64; N]) -> [f64; N] {
        let h = &self.h;
        if N == 1 {
            return std::array::from_fn(|i| v[i] / h[i][i]);
        }
        let determinant = h[0][0] * h[1][1] - h[0][1] * h[1][0];
        std::array::from_fn(|i| {
            let other = 1 - i;
            (h[other][other] * v[i] - h[i][other] * v[other]) / determinant
        })
    }
}

/// The step from `z` with this Hessian; `None` if the linearised margins are infeasible in the box.
pub(crate) fn quadratic_step<const N: usize>(
    z: &[f64; N],
    here: &Evaluation<N>,
    hessian: &[[f64; N]; N],
) -> Option<Step<N>> {
    let objective = Objective {
        g: here.gradient,
        h: convex(hessian, &here.gradient, z),
    };
    let mut rows = [Row {
        normal: [0.0; N],
        least: 0.0,
        margin: None,
    }; MAX_ROWS];
    for i in 0..N {
        rows[2 * i].normal[i] = 1.0;
        rows[2 * i].least = -1.0 - z[i];
        rows[2 * i + 1].normal[i] = -1.0;
        rows[2 * i + 1].least = z[i] - 1.0;
    }
    let mut count = 2 * N;
    // Usually no margin is active.
    let d = over(&objective, &rows[..count])?;
    for (j, margin) in here.margins().iter().enumerate() {
        rows[count] = Row {
            normal: margin.slopes,
            least: -margin.value,
            margin: Some(j),
        };
        count += 1;
    }
    let rows = &rows[..count];
    if meets(&d.0, rows) {
        return Some(Step {
            d: d.0,
            multipliers: [0.0; MAX_MARGINS],
        });
    }
    let (d, active) = over(&objective, rows)?;
    Some(Step {
        d,
        multipliers: multipliers_of(&objective, &d, active, rows),
    })
}

/// The active constraints.
type Active = [Option<usize>; 2];

/// The optimum over the rows, and which of them are active.
fn over<const N: usize>(objective: &Objective<N>, rows: &[Row<N>]) -> Option<([f64; N], Active)> {
    let free = objective.solve(&objective.g.map(|g| -g));
    if meets(&free, rows) {
        return Some((free, [None; 2]));
    }
    let mut best: Option<([f64; N], Active)> = None;
    let mut least = f64::INFINITY;
    let mut try_one = |d: [f64; N], active: Active| {
        let value = objective.at(&d);
        if value < least && meets(&d, rows) {
            least = value;
            best = Some((d, active));
        }
    };
    for (i, row) in rows.iter().enumerate() {
        // on the row: d = free + H^-1 n l with n.d = least
        let towards = objective.solve(&row.normal);
        let share = (row.least - dot(&row.normal, &free)) / dot(&row.normal, &towards);
        let mut d: [f64; N] = std::array::from_fn(|k| free[k] + towards[k] * share);
        // With small curvature `free` is far away, and the result carries its rounding error.
        let off = (row.least - dot(&row.normal, &d)) / dot(&row.normal, &row.normal);
        for (d, n) in d.iter_mut().zip(&row.normal) {
            *d += n * off;
        }
        try_one(d, [Some(i), None]);
        if N < 2 {
            continue;
        }
        for (j, other) in rows.iter().enumerate().skip(i + 1) {
            if let Some(d) = crossing(row, other) {
                try_one(d, [Some(i), Some(j)]);
            }
        }
    }
    best
}

/// Intersection of two rows as equations, for two variables; `None` if they are parallel.
fn crossing<const N: usize>(a: &Row<N>, b: &Row<N>) -> Option<[f64; N]> {
    let (p, q) = (&a.normal, &b.normal);
    let determinant = p[0] * q[1] - p[1] * q[0];
    let size = (dot(p, p) * dot(q, q)).sqrt();
    if !(determinant.abs() > ROUNDING * size) {
        return None;
    }
    let mut d = [0.0; N];
    d[0] = (a.least * q[1] - b.least * p[1]) / determinant;
    d[1] = (p[0] * b.least - q[0] * a.least) / determinant;
    Some(d)
}

fn meets<const N: usize>(d: &[f64; N], rows: &[Row<N>]) -> bool {
    rows.iter().all(|row| {
        let slack = ROUNDING * (1.0 + dot(&row.normal, &row.normal).sqrt());
        dot(&row.normal, d) >= row.least - slack
    })
}

/// Solves g + H d = sum l n over the active rows.
fn multipliers_of<const N: usize>(
    objective: &Objective<N>,
    d: &[f64; N],
    active: Active,
    rows: &[Row<N>],
) -> [f64; MAX_MARGINS] {
    let mut multipliers = [0.0; MAX_MARGINS];
    let gradient = objective.gradient(d);
    let mut set = |row: &Row<N>, value: f64| {
        if let Some(margin) = row.margin {
            multipliers[margin] = value.max(0.0);
        }
    };
    match active {
        [Some(i), Some(j)] if N > 1 => {
            let (p, q) = (&rows[i].normal, &rows[j].normal);
            let determinant = p[0] * q[1] - p[1] * q[0];
            set(
                &rows[i],
                (gradient[0] * q[1] - gradient[1] * q[0]) / determinant,
            );
            set(
                &rows[j],
                (gradient[1] * p[0] - gradient[0] * p[1]) / determinant,
            );
        }
        [Some(i), _] => {
            let normal = &rows[i].normal;
            set(&rows[i], dot(&gradient, normal) / dot(normal, normal));
        }
        _ => {}
    }
    multipliers
}

/// Makes the Hessian positive definite: negative curvature is replaced by the smallest positive one, so that a
/// step may go to the side of the box. Along a side that the gradient pushes against it is unchanged.
fn convex<const N: usize>(h: &[[f64; N]; N], g: &[f64; N], z: &[f64; N]) -> [[f64; N]; N] {
    let tiny = f64::MIN_POSITIVE.sqrt() + ROUNDING * dot(g, g).sqrt();
    if N == 1 {
        return std::array::from_fn(|_| [h[0][0].max(tiny); N]);
    }
    let (middle, off) = (0.5 * (h[0][0] + h[1][1]), h[0][1]);
    let half = 0.5 * (h[0][0] - h[1][1]);
    let radius = half.hypot(off);
    let least = (LEAST_CURVATURE_SHARE * (middle.abs() + radius)).max(tiny);
    if middle - radius >= least {
        return *h;
    }
    for (held, free) in [(0, 1), (1, 0)] {
        if z[held] * g[held] < 0.0 && z[held].abs() > 1.0 - AT_SIDE {
            let mut convex = *h;
            if h[free][free] > least {
                convex[held][held] = h[free][free] + 2.0 * off * off / h[free][free];
            } else {
                convex = [[0.0; N]; N];
                convex[free][free] = least;
                convex[held][held] = middle.abs() + radius;
            }
            return convex;
        }
    }
    let [large, small] = [middle + radius, middle - radius].map(|l| l.max(least));
    // H = m 1 + r (cos sin; sin -cos) of the doubled angle of its first eigenvector
    let (cos, sin) = if radius > 0.0 {
        (half / radius, off / radius)
    } else {
        (1.0, 0.0)
    };
    let (middle, radius) = (0.5 * (large + small), 0.5 * (large - small));
    let mut convex = *h;
    convex[0][0] = middle + radius * cos;
    convex[1][1] = middle - radius * cos;
    convex[0][1] = radius * sin;
    convex[1][0] = radius * sin;
    convex
}

pub(crate) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    (0..N).map(|i| a[i] * b[i]).sum()
}
