//! Inextensible rods in a plane: the curvature is the one strain, theta' = kappa, r' = (cos theta, sin theta).
//!
//! The end is free to turn. With J(a, b) = (-b, a) the couple under the end force n is m(s) = (r(1) - r(s)) x n = q.n,
//! q = J (r(1) - r(s)).

use super::grid::Grid;
use super::kinematics::{AtEnd, Borne, Kinematics, Local};
use super::loads_at_nodes::LoadsAtNodes;
use nalgebra::{DMatrix, SMatrix, Vector1, Vector2, Vector3, Vector6};

/// The kinematics of an inextensible rod in a plane, clamped along +x, with a point mass on its end.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Plane;

/// The shape of a rod in a plane.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlaneShape {
    /// (cos theta, sin theta) at the nodes.
    tangents: Vec<Vector2<f64>>,
    /// r at the nodes.
    positions: Vec<Vector2<f64>>,
    end: Vector2<f64>,
    end_angle: f64,
}

impl PlaneShape {
    /// Positions of the nodes.
    pub fn positions(&self) -> &[Vector2<f64>] {
        &self.positions
    }

    /// (cos theta, sin theta) at the nodes.
    pub fn tangents(&self) -> &[Vector2<f64>] {
        &self.tangents
    }

    /// Position of the end.
    pub fn end(&self) -> Vector2<f64> {
        self.end
    }

    /// theta(1).
    pub fn end_angle(&self) -> f64 {
        self.end_angle
    }

    fn lever(&self, i: usize) -> Vector2<f64> {
        let a = self.end - self.positions[i];
        Vector2::new(-a.y, a.x)
    }
}

impl Kinematics<1, 2> for Plane {
    type Shape = PlaneShape;
    /// Angles at the nodes.
    type Room = Vec<Vector1<f64>>;
    type Pose = Vector2<f64>;
    const PLACE: usize = 2;

    fn reshape(
        &self,
        grid: &Grid,
        strains: &[Local<1>],
        shape: &mut PlaneShape,
        angles: &mut Vec<Vector1<f64>>,
    ) -> Option<()> {
        angles.resize(grid.len(), Vector1::zeros());
        shape.end_angle = grid.integrate(strains, angles)[0];
        shape.tangents.clear();
        shape.tangents.extend(angles.iter().map(|angle| {
            let (sin, cos) = angle[0].sin_cos();
            Vector2::new(cos, sin)
        }));
        shape.positions.resize(grid.len(), Vector2::zeros());
        shape.end = grid.integrate(&shape.tangents, &mut shape.positions);
        shape.end.iter().all(|x| x.is_finite()).then_some(())
    }

    fn pose(&self, shape: &PlaneShape) -> Vector2<f64> {
        shape.end
    }

    fn axis(
        &self,
        grid: &Grid,
        shape: &PlaneShape,
        strains: &[Local<1>],
        places: &[f64],
    ) -> Vec<[Vector3<f64>; 2]> {
        let place = |s: &f64| {
            let r = grid.integral_at(&shape.tangents, *s);
            let (sin, cos) = grid.integral_at(strains, *s)[0].sin_cos();
            [Vector3::new(r.x, r.y, 0.0), Vector3::new(cos, sin, 0.0)]
        };
        places.iter().map(place).collect()
    }

    fn transfer(&self, shape: &PlaneShape, i: usize) -> SMatrix<f64, 1, 2> {
        shape.lever(i).transpose()
    }

    /// The directors are (z, d2, tangent).
    fn resultants(
        &self,
        grid: &Grid,
        shape: &PlaneShape,
        w: &AtEnd<2>,
        loads: Option<&LoadsAtNodes>,
    ) -> Vec<Vector6<f64>> {
        let borne = loads.map(|loads| {
            let f = &loads.dead;
            (self.borne(grid, shape, f).resultants, beyond(grid, f))
        });
        let node = |i: usize| {
            let (mut couple, mut n) = (shape.lever(i).dot(w), *w);
            if let Some((couples, forces)) = &borne {
                couple += couples[i][0];
                n += forces[i];
            }
            let t = shape.tangents[i];
            let across = n.x * t.y - n.y * t.x;
            Vector6::new(couple, 0.0, 0.0, 0.0, across, n.dot(&t))
        };
        (0..shape.tangents.len()).map(node).collect()
    }

    /// With N the force beyond a section, g_i = int_{s_i}^1 N.J t. This is the gradient of the discrete potential,
    /// since Gauss' rules have weight_i A_ij + weight_j A_ji = weight_i weight_j.
    fn borne(&self, grid: &Grid, shape: &PlaneShape, force: &[Vector3<f64>]) -> Borne<1> {
        let beyond = beyond(grid, force);
        let mut before = vec![Vector1::zeros(); grid.len()];
        let across = beyond.iter().zip(&shape.tangents);
        let across: Vec<_> = across
            .map(|(n, t)| Vector1::new(n.y * t.x - n.x * t.y))
            .collect();
        let total = grid.integrate(&across, &mut before);
        let forces = force.iter().zip(&shape.positions).zip(grid.weights());
        Borne {
            resultants: before.iter().map(|before| total - before).collect(),
            potential: -forces
                .map(|((f, r), weight)| weight * f.xy().dot(r))
                .sum::<f64>(),
        }
    }

    /// dg_i = -int_{s_i}^1 (t.N) dtheta.
    fn borne_stiffness(
        &self,
        grid: &Grid,
        shape: &PlaneShape,
        force: &[Vector3<f64>],
        out: &mut DMatrix<f64>,
    ) {
        add_turned(grid, shape, &beyond(grid, force), out);
    }

    /// d(q_i.n) = -int_{s_i}^1 (t.n) dtheta.
    fn load_stiffness(
        &self,
        grid: &Grid,
        shape: &PlaneShape,
        n: &AtEnd<2>,
        out: &mut DMatrix<f64>,
    ) {
        add_turned(grid, shape, &vec![*n; grid.len()], out);
    }

    /// The velocity of the end at fixed rates is int t' dtheta_t with t' = J t; its change is -int t theta_t dtheta,
    /// and by parts -weight_j int_{s_j}^1 t theta_t at node j.
    fn convection(
        &self,
        grid: &Grid,
        shape: &PlaneShape,
        rates: &[Local<1>],
        out: &mut DMatrix<f64>,
    ) {
        let mut turning = vec![Vector1::zeros(); grid.len()];
        grid.integrate(rates, &mut turning);
        let carried: Vec<Vector2<f64>> = shape
            .tangents
            .iter()
            .zip(&turning)
            .map(|(t, rate)| t * rate[0])
            .collect();
        let mut before = vec![Vector2::zeros(); grid.len()];
        let total = grid.integrate(&carried, &mut before);
        for (j, (so_far, weight)) in before.iter().zip(grid.weights()).enumerate() {
            out.set_column(j, &((so_far - total) * *weight));
        }
    }

    fn place(end: &Vector2<f64>, out: &mut [f64]) {
        out.copy_from_slice(end.as_slice());
    }

    /// The last Legendre coefficients of (cos theta, sin theta), over the number n of nodes: integration makes
    /// coefficients of degree n smaller by about n.
    fn defect(&self, grid: &Grid, shape: &PlaneShape) -> f64 {
        let tails = grid.tails(&shape.tangents);
        let sizes = tails.iter().zip(grid.counts());
        sizes
            .map(|(tail, n)| tail.now / n as f64)
            .fold(0.0, f64::max)
    }
}

/// Force beyond each node.
fn beyond(grid: &Grid, force: &[Vector3<f64>]) -> Vec<Vector2<f64>> {
    let flat: Vec<Vector2<f64>> = force.iter().map(|f| f.xy()).collect();
    let mut before = vec![Vector2::zeros(); grid.len()];
    let total = grid.integrate(&flat, &mut before);
    before.iter().map(|before| total - before).collect()
}

/// Adds -int_{s_i}^1 (t.n) dtheta for the forces n at the nodes.
fn add_turned(grid: &Grid, shape: &PlaneShape, n: &[Vector2<f64>], out: &mut DMatrix<f64>) {
    let inner = grid.integration();
    let weights = grid.weights();
    let mut scaled = inner.clone();
    for ((mut row, t), n) in scaled.row_iter_mut().zip(&shape.tangents).zip(n) {
        row *= -t.dot(n);
    }
    let outer = DMatrix::from_fn(weights.len(), weights.len(), |i, k| {
        weights[k] - inner[(i, k)]
    });
    out.gemm(1.0, &outer, &scaled, 1.0);
}
