//! The tests of the Python package, run by Python.

mod needs_python_package {
    use std::path::Path;
    use std::process::Command;

    use tipwatch_tests::python_package;

    #[test]
    #[ignore = "needs python3 with pytest, numpy, polars, pyarrow, pandas and duckdb"]
    fn its_own_tests_pass() {
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/tests");
        let mut pytest = Command::new(&python);
        pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
        pytest.arg(&tests).env("PYTHONPATH", python_package());
        pytest.env("PYTHONDONTWRITEBYTECODE", "1");
        let output = pytest.output().unwrap_or_else(|e| panic!("{python}: {e}"));
        let told = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{told}");
    }
}
