//! Study `recursion`: where recursive least squares diverges.

use crate::picture;
use crate::question::recursion::{
    self, DIVERGED, FORGETTING_FACTORS, Form, INITIAL_COVARIANCES, KINDS, Outcome, Plan, Study,
};
use clap::Args;
use host_sim::Result;

use host_sim::commands::arguments::of_option;
use host_sim::commands::progress::Terminal;
use host_sim::commands::scene_argument::{SceneArgument, read_one_row};
use host_sim::commands::{Common, print};

use super::Picture;

/// Study where recursive least squares diverges: by form, precision, λ, δ and condition.
///
/// The covariance form as textbooks print it stands beside the square-root form, in f32 and f64, on the regressors of one
/// row-wire. Each is compared with the batch solution of the problem that it solves, in f64.
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study recursion -o recursion.svg")]
pub struct Arguments {
    /// A built-in scene (paper, press) or the path of a scene file.
    #[arg(default_value = "paper")]
    scene: String,
    /// Row-wire (from 1) whose readings are the inputs.
    #[arg(long, value_name = "ROW", default_value_t = 4)]
    row: usize,
    #[command(flatten)]
    plan: Plan,
    #[command(flatten)]
    picture: Picture,
}

impl super::Study for Arguments {
    fn answer(&self, common: &Common) -> Result<()> {
        let argument = SceneArgument::new(&self.scene, None);
        let mut scene = argument.load_world(common)?;
        read_one_row(&mut scene, self.row)?;
        self.plan
            .check()
            .map_err(|bad| of_option(bad, &[("centres", "--centres"), ("updates", "--updates")]))?;
        self.picture.check(argument.path())?;
        let study = recursion::compute(&scene, &self.plan, &Terminal::new())?;
        self.picture.write(|| picture::recursion_svg(&study))?;
        super::show(common, &study, page_of)
    }
}

fn page_of(study: &Study) -> print::Page {
    let mut page = print::Page::default();
    let Plan { centres, updates } = study.plan;
    page.line(format_args!(
        "{}, row {}, K = {centres}, output {}, {updates} updates\n\n\
         difference from the batch solution in f64, in standard deviations of the output;\n\
         #N: diverged after N updates (a number not finite, or the next sample's prediction off by {DIVERGED} standard\n    \
         deviations, which is looked at after {} updates); ~N: so has the exact solution (covariance wind-up)",
        study.subject,
        study.row_wire,
        study.output,
        study.plan.settled_updates()
    ));
    let deltas: Vec<String> =
        INITIAL_COVARIANCES.iter().map(|d| format!("{:>9}", format!("{d:e}"))).collect();
    for (form, precision) in KINDS {
        let name = match form {
            Form::Covariance => "covariance form",
            Form::SquareRoot => "square-root form",
        };
        page.line(format_args!("\n{name} in {precision}"));
        for width in &study.widths {
            page.line(format_args!(
                "width {:<4} condition {:<8} δ ={}",
                width.width,
                format!("{:.0e}", width.condition),
                deltas.concat()
            ));
            for forgetting in FORGETTING_FACTORS {
                let cell = |delta: &f64| {
                    study
                        .outcome((form, precision), width.width, forgetting, *delta)
                        .map_or(String::new(), text)
                };
                let cells: Vec<String> =
                    INITIAL_COVARIANCES.iter().map(|delta| format!("{:>9}", cell(delta))).collect();
                page.line(format_args!("{:>28} {:<6}{}", "λ =", forgetting, cells.concat()));
            }
        }
    }
    page
}

fn text(outcome: &Outcome) -> String {
    match (outcome.diverged_after, outcome.difference) {
        (Some(updates), _) if outcome.wound_up => format!("~{updates}"),
        (Some(updates), _) => format!("#{updates}"),
        (None, Some(difference)) => format!("{difference:.0e}"),
        (None, None) => "-".into(),
    }
}
