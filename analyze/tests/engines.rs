//! The files of `deploy`: they are what their engine reads, and their commands make the data set of one run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use yaml_rust2::{Yaml, YamlLoader};

use super::screen::{files, mixed_logs, result, screen};
use super::support::{command, data, stderr, text};

/// Number of parts that the files name.
const PARTS: &str = "100";

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging/deploy")
}

fn yaml(name: &str) -> Yaml {
    let text = fs::read_to_string(deploy().join(name)).unwrap();
    let mut documents = YamlLoader::load_from_str(&text).unwrap();
    assert_eq!(documents.len(), 1, "{name}");
    documents.remove(0)
}

fn words(list: &Yaml) -> Vec<String> {
    let words = list.as_vec().expect("a list of words").iter();
    words
        .map(|word| word.as_str().expect("a word").to_string())
        .collect()
}

fn json(name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(deploy().join(name)).unwrap()).unwrap()
}

/// The arguments after `tipwatch`.
fn batch_words(job: &Value) -> Vec<String> {
    let words = job["containerProperties"]["command"]
        .as_array()
        .unwrap()
        .iter();
    let mut words: Vec<String> = words
        .map(|word| word.as_str().unwrap().to_string())
        .collect();
    assert_eq!(words.remove(0), "tipwatch");
    words
}

/// Logs, machine files and the outputs of an engine's tasks, in one folder each.
struct Cluster {
    folder: TempDir,
}

impl Cluster {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let machines = folder.path().join("machines");
        fs::create_dir(&machines).unwrap();
        for name in ["tiny_lift.toml", "tiny_lift.urdf"] {
            fs::copy(data(name), machines.join(name)).unwrap();
        }
        fs::write(
            machines.join("fleet.toml"),
            "default = \"tiny_lift.toml\"\n",
        )
        .unwrap();
        fs::rename(mixed_logs().keep(), folder.path().join("logs")).unwrap();
        Self { folder }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the arguments of a file with the folders here and three parts.
    fn run(&self, words: &[String], variables: &[(&str, String)]) -> i32 {
        let here = |word: &String| match word.strip_prefix('/') {
            Some(path) => text(&self.at(path)).to_string(),
            None => word.replace(&format!("/{PARTS}"), "/3"),
        };
        let words: Vec<String> = words.iter().map(here).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let output = command(&words)
            .envs(variables.iter().cloned())
            .output()
            .unwrap();
        let code = output.status.code().unwrap();
        assert_ne!(code, 2, "{words:?}: {}", stderr(&output));
        code
    }

    /// The data set of one run over the same logs.
    fn of_one_run(&self) -> (i32, BTreeMap<String, Vec<u8>>) {
        let whole = self.at("whole");
        let fleet = self.at("machines/fleet.toml");
        let (code, _) = screen(&self.at("logs"), &whole, &["--fleet", text(&fleet)]);
        (code, result(&whole))
    }
}

/// Runs three parts and gathers them; `part` gives the words and variables of part 0, 1 and 2.
fn gathers_to_one_run(
    part: impl Fn(usize) -> (Vec<String>, Vec<(&'static str, String)>),
    gather: &[String],
) {
    let cluster = Cluster::new();
    for index in 0..3 {
        let (words, variables) = part(index);
        assert_eq!(cluster.run(&words, &variables), 0, "part {index}");
    }
    assert!(!files(&cluster.at("records")).is_empty());
    let code = cluster.run(gather, &[]);
    let (one_code, one) = cluster.of_one_run();
    assert_eq!(code, one_code);
    assert!(
        result(&cluster.at("fleet")) == one,
        "the data set differs from a single run"
    );
}

#[test]
fn an_indexed_job_of_kubernetes_makes_the_data_set_of_one_run() {
    let container = |job: &Yaml| job["spec"]["template"]["spec"]["containers"][0].clone();
    let (job, gather) = (
        yaml("kubernetes/screen.yaml"),
        yaml("kubernetes/gather.yaml"),
    );
    assert_eq!(job["kind"].as_str(), Some("Job"));
    assert_eq!(job["spec"]["completionMode"].as_str(), Some("Indexed"));
    assert_eq!(job["spec"]["completions"].as_i64(), PARTS.parse().ok());
    // more pods than lost attempts, so that the failure gets written
    assert!(job["spec"]["backoffLimitPerIndex"].as_i64().unwrap() > 3);
    let words_of = |job: &Yaml| words(&container(job)["args"]);
    gathers_to_one_run(
        |index| {
            (
                words_of(&job),
                vec![("JOB_COMPLETION_INDEX", index.to_string())],
            )
        },
        &words_of(&gather),
    );
}

#[test]
fn a_workflow_of_argo_makes_the_data_set_of_one_run() {
    let workflow = yaml("argo/screen.yaml");
    let templates = workflow["spec"]["templates"].as_vec().unwrap();
    let args = |name: &str| {
        let template = templates
            .iter()
            .find(|t| t["name"].as_str() == Some(name))
            .unwrap();
        words(&template["container"]["args"])
    };
    let sequence = &templates[0]["dag"]["tasks"][0]["withSequence"];
    assert_eq!(
        (sequence["start"].as_str(), sequence["end"].as_str()),
        (Some("1"), Some(PARTS))
    );
    gathers_to_one_run(
        |index| {
            let part = (index + 1).to_string();
            let words = args("part").into_iter();
            let filled = words.map(|word| word.replace("{{inputs.parameters.part}}", &part));
            (filled.collect(), Vec::new())
        },
        &args("gather"),
    );
}

#[test]
fn an_array_job_of_aws_batch_makes_the_data_set_of_one_run() {
    let (job, gather) = (json("aws-batch/screen.json"), json("aws-batch/gather.json"));
    assert!(job["retryStrategy"]["attempts"].as_i64().unwrap() > 3);
    gathers_to_one_run(
        |index| {
            let variables = vec![
                ("AWS_BATCH_JOB_ARRAY_INDEX", index.to_string()),
                ("AWS_BATCH_JOB_ARRAY_SIZE", "3".to_string()),
            ];
            (batch_words(&job), variables)
        },
        &batch_words(&gather),
    );
}

#[test]
fn a_job_array_of_slurm_makes_the_data_set_of_one_run() {
    let cluster = Cluster::new();
    // the script itself runs, with this program in its path and three parts
    let programs = cluster.at("programs");
    fs::create_dir(&programs).unwrap();
    let program = PathBuf::from(env!("CARGO_BIN_EXE_tipwatch"));
    std::os::unix::fs::symlink(&program, programs.join("tipwatch")).unwrap();
    let run = |name: &str, task: Option<usize>| {
        let script = fs::read_to_string(deploy().join("slurm").join(name)).unwrap();
        let mut bash = Command::new("bash");
        bash.arg("-c")
            .arg(script.replace(&format!("/{PARTS}"), "/3"));
        for (variable, folder) in [
            ("LOGS", "logs"),
            ("MACHINES", "machines"),
            ("RECORDS", "records"),
            ("FLEET", "fleet"),
        ] {
            bash.env(variable, cluster.at(folder));
        }
        bash.env("PATH", format!("{}:/usr/bin:/bin", programs.display()));
        bash.envs(task.map(|task| ("SLURM_ARRAY_TASK_ID", task.to_string())));
        let output = bash.output().unwrap();
        (output.status.code().unwrap(), stderr(&output))
    };
    for task in [2, 0, 1] {
        assert_eq!(run("screen.sbatch", Some(task)).0, 0);
    }
    let (code, messages) = run("gather.sbatch", None);
    let (one_code, one) = cluster.of_one_run();
    assert_eq!(code, one_code, "{messages}");
    assert!(
        result(&cluster.at("fleet")) == one,
        "the data set differs from a single run"
    );
    // without a task number the script does not analyse everything in every task
    let (code, messages) = run("screen.sbatch", None);
    assert!(
        code == 2 && messages.contains("SLURM_ARRAY_TASK_ID"),
        "{code}: {messages}"
    );
}

#[test]
fn scripts_are_valid_and_name_the_files_beside_them() {
    let scripts = files(&deploy()).into_iter();
    let scripts = scripts.filter(|(name, _)| name.ends_with(".sh") || name.ends_with(".sbatch"));
    let mut count = 0;
    for (name, path) in scripts {
        let checked = Command::new("bash").arg("-n").arg(&path).output().unwrap();
        assert!(checked.status.success(), "{name}: {}", stderr(&checked));
        count += 1;
    }
    assert_eq!(count, 4);
    let submit = fs::read_to_string(deploy().join("slurm/submit.sh")).unwrap();
    assert!(submit.contains("screen.sbatch") && submit.contains("gather.sbatch"));
    let submit = fs::read_to_string(deploy().join("aws-batch/submit.sh")).unwrap();
    assert!(submit.contains("file://$job.json") && submit.contains("for job in screen gather"));
}

mod needs_python {
    use super::*;
    use crate::support::run_python;

    /// Which files are logs is known by the program alone.
    #[test]
    #[ignore = "needs python3"]
    fn a_plan_measures_all_logs_that_the_program_reads() {
        let logs = TempDir::new().unwrap();
        fs::copy(data("tiny_lift.mcap"), logs.path().join("shift.MCAP")).unwrap();
        let (plan, machine) = (deploy().join("plan.py"), data("tiny_lift.toml"));
        let measured = [text(&plan), "--measure", text(logs.path())];
        let program = ["--program", env!("CARGO_BIN_EXE_tipwatch")];
        run_python(&[&measured[..], &["--machine", text(&machine)], &program].concat());
    }
}
