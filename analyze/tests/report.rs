//! The report as a browser shows it.

mod needs_browser {
    use std::path::Path;

    use tempfile::TempDir;

    use crate::support::{data, run_python, stderr, text, tipwatch};

    #[test]
    #[ignore = "needs Chromium and Python with websocket-client"]
    fn the_report_works_in_a_browser() {
        let out = TempDir::new().unwrap();
        let (log, machine) = (data("swing_lift.mcap"), data("swing_lift.toml"));
        let arguments = ["analyze", text(&log), "--machine", text(&machine)];
        let analysed = tipwatch(&[&arguments[..], &["--out", text(out.path())]].concat());
        assert_eq!(analysed.status.code(), Some(0), "{}", stderr(&analysed));
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report.py");
        run_python(&[text(&script), text(&out.path().join("report.html"))]);
    }
}
