//! Sums over elements, their derivatives, and whether a model is affine in its factors.

use crate::element::Matrices;
use crate::error::FemError;
use crate::model::{Affine, BATCH, Model};
use crate::scalar::Dual;
use crate::small::Mat;
use crate::system::{Increment, Parts};
use rayon::prelude::*;

impl Model {
    /// Sum of elements with factors, both triangles.
    pub(crate) fn add_elements(&self, list: &[usize], factors: &[f64]) -> Result<Parts, FemError> {
        self.scatter_all(list, |e| self.evaluate(e, |i| factors[i]))
    }

    fn scatter_all(
        &self,
        list: &[usize],
        matrices: impl Fn(usize) -> Matrices<f64> + Sync,
    ) -> Result<Parts, FemError> {
        let mut out = Parts::default();
        for batch in list.chunks(BATCH) {
            let evaluated: Vec<Matrices<f64>> =
                batch.par_iter().with_min_len(64).map(|&e| matrices(e)).collect();
            for (&e, Matrices { k, m, c, h }) in batch.iter().zip(&evaluated) {
                for (a, values) in [k, m, c, h].into_iter().zip(&mut out.0) {
                    let Some(a) = a else { continue };
                    if a.data.iter().any(|v| !v.is_finite()) {
                        let element = &self.elements[e];
                        let why = "has no finite stiffness or mass with these values".to_owned();
                        return Err(FemError::Element { what: element.card.to_owned(), id: element.id, why });
                    }
                    let values = values.get_or_insert_with(|| vec![0.0; self.pattern().nnz()]);
                    self.scatter.add(e, a, values);
                }
            }
        }
        for values in out.0.iter_mut().flatten() {
            self.scatter.symmetrise(values);
        }
        Ok(out)
    }

    /// Derivative by factor `i` at the given factors.
    pub(crate) fn evaluate_derivative(&self, i: usize, factors: &[f64]) -> Result<Parts, FemError> {
        let part =
            |a: Mat<Dual>| Mat { rows: a.rows, cols: a.cols, data: a.data.iter().map(|x| x.d).collect() };
        let matrices = |e: usize| {
            let at = |j: usize| Dual { v: factors[j], d: f64::from(u8::from(j == i)) };
            let Matrices { k, m, c, h } = self.evaluate(e, at);
            // what does not move with this factor takes no place in the sum
            let part = |a: Option<Mat<Dual>>| a.map(part).filter(|a| a.data.iter().any(|v| *v != 0.0));
            Matrices { k: part(k), m: part(m), c: part(c), h: part(h) }
        };
        self.scatter_all(&self.touched[i], matrices)
    }

    /// Sums the elements no parameter acts on, refuses parameters without effect, and finds out whether the model is
    /// affine: then the derivatives at two different points agree.
    pub(crate) fn prepare(&mut self) -> Result<(), FemError> {
        let constant: Vec<usize> = (0..self.elements.len()).filter(|&e| self.applied[e].is_empty()).collect();
        let ones = vec![1.0; self.parameters.len()];
        self.fixed = self.add_elements(&constant, &ones)?;
        // an irregular second point, so that no product of factors is constant along the way
        let other: Vec<f64> =
            (0..ones.len()).map(|i| 1.0 + 0.37 * ((i as f64 * 0.618_034 + 0.3) % 1.0) + 0.11).collect();
        let mut derivatives = Vec::with_capacity(ones.len());
        let mut affine = true;
        for i in 0..ones.len() {
            let here = self.evaluate_derivative(i, &ones)?;
            let there = self.evaluate_derivative(i, &other)?;
            if !changes(&here) && !changes(&there) {
                let p = &self.parameters[i];
                let (noun, ids) = p.target.ids();
                let why = format!(
                    "its factor changes nothing: {:?} of {noun} {ids:?} has no part in K, M or C; correct property or target",
                    p.quantity
                );
                return Err(FemError::Parameter { name: p.name.clone(), why });
            }
            affine = affine && agree(&here, &there);
            if affine {
                derivatives.push(here.0.map(|a| Increment::new(a.as_deref())));
            }
        }
        if affine {
            let changing: Vec<usize> =
                (0..self.elements.len()).filter(|&e| !self.applied[e].is_empty()).collect();
            let mut nominal = self.add_elements(&changing, &ones)?;
            nominal.add(&self.fixed);
            // what is fixed is in the nominal values from here on
            self.fixed = Parts::default();
            self.affine = Some(Affine { nominal, derivatives });
        }
        Ok(())
    }
}

fn changes(d: &Parts) -> bool {
    d.0.iter().flatten().any(|a| a.iter().any(|v| *v != 0.0))
}

fn agree(a: &Parts, b: &Parts) -> bool {
    let largest = |x: &[f64]| x.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    a.0.iter().zip(&b.0).all(|(x, y)| match (x, y) {
        (Some(x), Some(y)) => {
            let limit = 1e-10 * largest(x);
            x.iter().zip(y).all(|(p, q)| (p - q).abs() <= limit)
        }
        (None, None) => true,
        (Some(x), None) | (None, Some(x)) => largest(x) == 0.0,
    })
}
