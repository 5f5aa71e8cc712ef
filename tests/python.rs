//! The tests of the Python package, run by Python.

use std::path::Path;
use std::process::Command;

use tipwatch_tests::python_package;

/// Runs the tests in a file or folder of `analyze/python/tests`, without those in a folder that others run.
fn pytest(tests: &str, without: Option<&str>) {
    let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../analyze/python/tests");
    let mut pytest = Command::new(&python);
    pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
    pytest
        .arg(folder.join(tests))
        .env("PYTHONPATH", python_package());
    // where the sources of the package hide the one that was built
    pytest.current_dir(folder.join(".."));
    if let Some(without) = without {
        pytest.arg("--ignore").arg(folder.join(without));
    }
    pytest.env("PYTHONDONTWRITEBYTECODE", "1");
    let output = pytest.output().unwrap_or_else(|e| panic!("{python}: {e}"));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}");
}

mod needs_python_package {
    #[test]
    #[ignore = "needs python3 with pytest, numpy, polars, pyarrow, pandas and duckdb"]
    fn its_own_tests_pass() {
        super::pytest("", Some("engines"));
    }
}

mod needs_ray {
    #[test]
    #[ignore = "needs python3 with pytest, numpy, polars, ray, boto3 and moto"]
    fn fleets_on_ray_lose_no_log() {
        super::pytest("engines/test_ray.py", None);
        super::pytest("engines/test_session.py", None);
    }
}

mod needs_delta {
    #[test]
    #[ignore = "needs python3 with pytest, polars, pyarrow, duckdb and deltalake"]
    fn delta_tables_have_the_rows_of_the_data_set() {
        super::pytest("engines/test_delta.py", None);
    }
}

mod needs_dask {
    #[test]
    #[ignore = "needs python3 with pytest, numpy, polars, distributed, boto3 and moto"]
    fn fleets_on_dask_lose_no_log() {
        super::pytest("engines/test_dask.py", None);
    }
}
