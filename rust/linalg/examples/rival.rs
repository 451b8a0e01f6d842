//! Times one factorisation on a matrix exported by `benches/rivals.py`; prints one line of JSON.
//!
//! `rival FILE KIND REPEATS`, KIND: cholesky, indefinite, complex, symbolic. The file holds little-endian n, nnz (u64), column
//! pointers (n + 1, u32), rows (nnz, u32) and values (nnz f64, or 2 nnz for complex) of a symmetric matrix, both triangles.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use femend_linalg::{ComplexFactor, Dense, Factor, Kind, Ordering, Pattern, Symbolic, SymmetricCsc};
use num_complex::Complex64;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Seconds on the clock and on processors, of all threads.
fn clock(start: Instant) -> (f64, f64) {
    let mut ns = 0.0;
    for task in std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten() {
        let text = std::fs::read_to_string(task.path().join("schedstat")).unwrap_or_default();
        ns += text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).unwrap_or(0.0);
    }
    (start.elapsed().as_secs_f64(), 1e-9 * ns)
}

/// Largest resident set in MB.
fn peak() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default().to_owned();
    line.split_whitespace().nth(1).and_then(|v| v.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

fn words<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [u8; N]> + '_ {
    bytes.chunks_exact(N).map(|c| c.try_into().expect("chunks have N bytes"))
}

/// Pattern and values.
fn read(path: &str) -> Result<(Arc<Pattern>, Vec<f64>)> {
    let bytes = std::fs::read(path)?;
    let head: Vec<u64> = words(&bytes[..16]).map(u64::from_le_bytes).collect();
    let (n, nnz) = (head[0] as usize, head[1] as usize);
    let index =
        |from: usize, len: usize| words(&bytes[from..from + 4 * len]).map(u32::from_le_bytes).collect();
    let rows = 16 + 4 * (n + 1);
    let pattern = Pattern::new(n, index(16, n + 1), index(rows, nnz))?;
    let values = words(&bytes[rows + 4 * nnz..]).map(f64::from_le_bytes).collect();
    Ok((Arc::new(pattern), values))
}

/// Measures one piece of work: medians over repeats, written to `json` as wall and CPU seconds.
fn time<T>(
    name: &str,
    repeats: usize,
    json: &mut Vec<String>,
    mut work: impl FnMut() -> Result<T>,
) -> Result<T> {
    let start = Instant::now();
    let (mut wall, mut cpu) = (vec![], vec![]);
    let mut last = None;
    for _ in 0..repeats.max(1) {
        drop(last.take());
        let (w, c) = clock(start);
        last = Some(work()?);
        let (v, d) = clock(start);
        wall.push(v - w);
        cpu.push(d - c);
    }
    let median = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    json.push(format!("\"{name}\": {:.6}, \"{name}_cpu\": {:.6}", median(&mut wall), median(&mut cpu)));
    Ok(last.expect("at least one repeat"))
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}

/// Real loads (n, k), uneven.
fn load(n: usize, k: usize) -> Vec<f64> {
    (0..n * k).map(|i| ((i as f64) * 0.754_877_666).fract() - 0.5).collect()
}

fn real(
    symbolic: Arc<Symbolic>,
    values: &[f64],
    kind: Kind,
    repeats: usize,
    json: &mut Vec<String>,
) -> Result<()> {
    let mut factor = time("first", 1, json, || Ok(Factor::new(symbolic.clone(), values, kind, None)?))?;
    time("factor", repeats, json, || Ok(factor.refresh(values, None)?))?;
    let n = factor.n();
    for k in [1, 16, 64] {
        let b = Dense::from_vec(n, k, load(n, k));
        let x = time(&format!("solve{k}"), repeats, json, || Ok(factor.solve(&b)))?;
        if k == 1 {
            let a = SymmetricCsc::new(symbolic.pattern().clone(), values.to_vec(), "A")?;
            let difference: Vec<f64> = a.times(&x).data().iter().zip(b.data()).map(|(a, b)| a - b).collect();
            json.push(format!("\"residual\": {:e}", norm(&difference) / norm(b.data())));
        }
    }
    json.push(format!("\"nneg\": {}", factor.inertia().negative));
    Ok(())
}

fn complex(symbolic: Arc<Symbolic>, values: &[f64], repeats: usize, json: &mut Vec<String>) -> Result<()> {
    let values: Vec<Complex64> = values.chunks_exact(2).map(|v| Complex64::new(v[0], v[1])).collect();
    let mut factor = time("first", 1, json, || Ok(ComplexFactor::new(symbolic.clone(), &values)?))?;
    time("factor", repeats, json, || Ok(factor.refresh(&values)?))?;
    for k in [1, 16, 64] {
        let b: Vec<Complex64> = load(symbolic.pattern().n(), k).into_iter().map(Complex64::from).collect();
        time(&format!("solve{k}"), repeats, json, || {
            let mut x = b.clone();
            factor.solve_in_place(&mut x);
            Ok(x)
        })?;
    }
    json.push(format!("\"residual\": {:e}", factor.probe()));
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, kind, repeats] = &arguments[..] else {
        println!("rival FILE KIND REPEATS: see benches/rivals.py");
        return Ok(());
    };
    let (pattern, values) = read(path)?;
    let repeats: usize = repeats.parse()?;
    let mut json = vec![format!("\"n\": {}, \"baseMB\": {:.0}", pattern.n(), peak())];
    let symbolic =
        time("analyze", 1, &mut json, || Ok(Arc::new(Symbolic::new(pattern.clone(), Ordering::Auto)?)))?;
    let memory = symbolic.memory();
    json.push(format!(
        "\"lnz\": {}, \"stored\": {}, \"flops\": {}, \"ordering\": \"{:?}\", \"factorMB\": {:.0}, \"workMB\": {:.0}",
        symbolic.permutation().nnz,
        symbolic.nnz(),
        symbolic.flops(),
        symbolic.permutation().ordering,
        memory.factor as f64 / 1048576.0,
        memory.work as f64 / 1048576.0
    ));
    match kind.as_str() {
        "cholesky" => real(symbolic, &values, Kind::Cholesky, repeats, &mut json)?,
        "indefinite" => real(symbolic, &values, Kind::Indefinite, repeats, &mut json)?,
        "complex" => complex(symbolic, &values, repeats, &mut json)?,
        "symbolic" => {
            for (name, kind) in [("amd", Ordering::Amd), ("nd", Ordering::NestedDissection)] {
                let p = time(name, 1, &mut json, || Ok(femend_linalg::order(&pattern, kind)?))?;
                json.push(format!("\"{name}_flops\": {}, \"{name}_lnz\": {}", p.flops, p.nnz));
            }
        }
        other => {
            return Err(
                format!("KIND '{other}' is unknown; use cholesky, indefinite, complex or symbolic").into()
            );
        }
    }
    println!("JSON {{{}, \"peakMB\": {:.0}}}", json.join(", "), peak());
    Ok(())
}
