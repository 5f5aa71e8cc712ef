//! The model of a channel: position, velocity and acceleration, driven by white jerk of spectral density q.

/// Position-velocity-acceleration state of a channel: value, first and second time derivative.
pub(crate) type ChannelState = [f64; 3];

/// A filter's estimate of a channel at a given time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Channel {
    pub(super) jet: ChannelState,
    /// Lag of the estimate behind a motion that changes fast, in addition to its noise: see [`lag`](super::lag).
    pub(super) lag: ChannelState,
}

/// Covariance of such a state, or a gain.
pub(crate) type Matrix = [[f64; 3]; 3];

/// The symmetric matrix with this upper triangle, rows and columns from zero. Rounding tears the two triangles of a
/// recursively computed covariance apart, further and further: only one of them may be computed.
pub(super) fn symmetric(upper: impl Fn(usize, usize) -> f64) -> Matrix {
    let (m00, m01, m02) = (upper(0, 0), upper(0, 1), upper(0, 2));
    let (m11, m12, m22) = (upper(1, 1), upper(1, 2), upper(2, 2));
    [[m00, m01, m02], [m01, m11, m12], [m02, m12, m22]]
}

pub(super) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

/// F(dt) x
pub(super) fn step(jet: &ChannelState, dt: f64) -> ChannelState {
    let [value, first, second] = *jet;
    [
        value + dt * (first + 0.5 * dt * second),
        first + dt * second,
        second,
    ]
}

/// F P F' + Q, with Q the covariance that white jerk of this density adds over dt.
pub(super) fn predicted(p: &Matrix, dt: f64, density: f64) -> Matrix {
    let (d1, d2) = (dt, 0.5 * dt * dt);
    // F P: the Taylor step applied to the rows of P
    let fp: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| match i {
            0 => p[0][j] + d1 * p[1][j] + d2 * p[2][j],
            1 => p[1][j] + d1 * p[2][j],
            _ => p[2][j],
        })
    });
    let (q1, q2, q3) = (density * dt, density * dt * dt, density * dt * dt * dt);
    let q: Matrix = [
        [q3 * dt * dt / 20.0, q3 * dt / 8.0, q3 / 6.0],
        [q3 * dt / 8.0, q3 / 3.0, q2 / 2.0],
        [q3 / 6.0, q2 / 2.0, q1],
    ];
    symmetric(|i, j| {
        let r = fp[i];
        let across = match j {
            0 => r[0] + d1 * r[1] + d2 * r[2],
            1 => r[1] + d1 * r[2],
            _ => r[2],
        };
        across + q[i][j]
    })
}

/// G = P F' inv(P_next)
pub(super) fn smoother_gain(filtered: &Matrix, next: &Matrix, dt: f64) -> Matrix {
    let (d1, d2) = (dt, 0.5 * dt * dt);
    let inverse = inverse(next);
    std::array::from_fn(|i| {
        let r = filtered[i];
        let pf = [r[0] + d1 * r[1] + d2 * r[2], r[1] + d1 * r[2], r[2]];
        std::array::from_fn(|j| {
            pf[0] * inverse[0][j] + pf[1] * inverse[1][j] + pf[2] * inverse[2][j]
        })
    })
}

/// Inverse of a symmetric positive definite matrix, by its adjugate.
fn inverse(m: &Matrix) -> Matrix {
    let minor = |a: usize, b: usize, c: usize, d: usize| m[a][c] * m[b][d] - m[a][d] * m[b][c];
    let (c00, c01, c02) = (minor(1, 2, 1, 2), -minor(1, 2, 0, 2), minor(1, 2, 0, 1));
    let (c11, c12, c22) = (minor(0, 2, 0, 2), -minor(0, 2, 0, 1), minor(0, 1, 0, 1));
    let scale = 1.0 / (m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02);
    [
        [c00 * scale, c01 * scale, c02 * scale],
        [c01 * scale, c11 * scale, c12 * scale],
        [c02 * scale, c12 * scale, c22 * scale],
    ]
}
