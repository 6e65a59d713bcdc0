/// The only file that reads CLI11, which takes longer than the rest of the program to compile.
#include "command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "core/messages.hpp"
#include "perikit/core/errors.hpp"

namespace perikit::app {

namespace {

void add_commands(CLI::App& app, Options& options) {
  const auto add = [&](const char* name, const char* text, void (*command)(const Options&)) {
    CLI::App* sub = app.add_subcommand(name, text);
    sub->callback([&options, command] { options.command = command; });
    sub->add_option("--plugin-path", options.plugin_path, "Further folders of plugins, searched first")->allow_extra_args(false);
    return sub;
  };
  const auto with_scene = [&](CLI::App* sub) {
    sub->add_option("scene", options.scene, "Scene file (TOML)")->required();
    sub->add_option("--set", options.overrides, "key=value: overrides a value of the scene, e.g. integrator.end_time=1e-3");
    sub->add_option("--threads", options.threads, "Threads; default: all cores")->check(CLI::Range(1, 1024));
    sub->add_flag("--trust", options.trust, "Open the libraries that the scene itself lists");
    sub->add_flag("--explain", options.explain, "Print what is skipped, why, and what that saves");
  };
  CLI::App* run_command = add("run", "Run a scene", run);
  with_scene(run_command);
  run_command->add_option("-o,--output", options.output, "Folder for the results; default: out/<scene>");
  run_command->add_flag("--resume", options.resume, "Go on from the last checkpoint of the folder");
  run_command->add_flag("--force", options.force, "Replace files in the folder that perikit did not write");
  run_command->add_flag("--quiet", options.quiet, "No progress, no summary");
  CLI::App* check_command =
      add("check", "Check a scene without running it; print it resolved, with sizes, memory and time step", check);
  with_scene(check_command);
  check_command->add_option("-o,--output", options.output, "Draw the body with its sets, loads and boundaries into this picture (.png, .svg, .pdf)");
  check_command->get_option("scene")->required(false);
  CLI::Option* machine = check_command->add_flag("--machine", options.machine,
                                                 "Instead of a scene: whether this build computes on this machine what it should")
                             ->excludes("scene");
  check_command->add_option("--write", options.machine_values, "Write the values of this build, which others compare theirs with, to this file")->needs(machine);
  check_command->add_option("--ranks", options.ranks, "Predict what each of so many ranks holds and exchanges")
      ->check(CLI::Range(1, 100000));
  CLI::App* study_command =
      add("study", "Run a scene for lists of values of some of its keys; write a table and a work-precision plot", study);
  study_command->add_option("study", options.scene, "Study file (TOML)")->required();
  study_command->add_option("-o,--output", options.output, "Folder for table, plot and runs; default: out/<study>");
  study_command->add_option("--set", options.overrides, "key=value: overrides a value of the scene in every run");
  study_command->add_option("--threads", options.threads, "Threads of each run; default: all cores")->check(CLI::Range(1, 1024));
  study_command->add_option("--jobs", options.jobs, "Runs side by side; the default, 1, is for run times that are to be compared")
      ->default_val(1)
      ->check(CLI::Range(1, 1024));
  study_command->add_flag("--keep-going", options.keep_going, "Exit status 0 also where runs have failed or were refused");
  study_command->add_flag("--resume", options.resume, "Keep the runs of the folder that are done already");
  study_command->add_flag("--force", options.force, "Replace files in the folder that perikit did not write");
  study_command->add_flag("--trust", options.trust, "Open the libraries that the scene itself lists");
  study_command->add_flag("--quiet", options.quiet, "No progress, no summary");
  CLI::App* plot_command = add("plot", "Draw a field of a run, or curves of histories", plot);
  plot_command->add_option("results", options.plot.results, "Folder of a run, or its results.h5; of several with --y")->required();
  CLI::Option* field = plot_command->add_option("--field", options.plot.field, "Point field, or history:NAME for a column of history.csv")->capture_default_str();
  CLI::Option* y = plot_command->add_option("--y", options.plot.y, "A column of history.csv: a curve of it for each run")->excludes(field);
  plot_command->add_option("--x", options.plot.x, "The column that --y is drawn over; default: time")->needs(y);
  plot_command->add_option("--window", options.window, "x0 x1 y0 y1: the part of the picture to draw, of bodies in a plane or on a line and of curves")->expected(4);
  plot_command->add_option("--component", options.plot.component, "x, y, z, magnitude; xx ... zz, von_mises, trace, determinant");
  plot_command->add_option("--frame", options.frame, "Frame index; default: the last one");
  plot_command->add_option("--deformed", options.plot.deformed, "Factor of the displacement that is added to the positions");
  plot_command->add_option("--view", options.view, "3D: direction from the body to the eye")->expected(3);
  plot_command->add_option("--range", options.range, "Ends of the colour scale")->expected(2);
  plot_command->add_option("--unit", options.unit, "Unit to show, where the scene is not in SI");
  plot_command->add_option("-o,--output", options.output,
                           "Picture: .png, .svg or .pdf; default: <field>_<frame>.png in the folder of the run");
  CLI::App* bench_command = add("bench", "Speed of the kernels beside the limits of this machine", bench);
  bench_command->add_option("--kinematics", options.bench.kinematics,
                            "Which; with a penalty: conventional+silling; default: all known ones");
  bench_command->add_option("--material", options.bench.materials, "Which")->capture_default_str();
  bench_command->add_option("--dimension", options.bench.dimensions, "1, 2 or 3, or several of them")
      ->check(CLI::Range(1, 3))
      ->allow_extra_args()
      ->capture_default_str();
  bench_command->add_option("--plane", options.bench.lateral, "Planes and lines: zero strain or zero stress across them, or both in turn")
      ->check(CLI::IsMember({"strain", "stress"}))
      ->capture_default_str();
  bench_command->add_option("--cells", options.bench.cells, "Points along each side, or along x, y and z")
      ->check(CLI::Range(2, 100000000))
      ->expected(1, 3)
      ->capture_default_str();
  bench_command->add_flag("--assembly", options.bench.assembly,
                          "The assembly of the tangent too; it needs memory: up to tens of kilobytes a point in 3D");
  bench_command->add_option("--json", options.bench.json, "Write the figures to this file as well");
  bench_command->add_option("--operations", options.bench.operations,
                            "CSV of operations a point and step; default: the one that comes with perikit");
  bench_command->add_flag("--threads-model", options.bench.threads_model,
                          "Instead: the efficiency of a step on 2 to 64 threads, from the times of its blocks on one")
      ->excludes("--assembly")
      ->excludes("--json")
      ->excludes("--operations");
  bench_command->add_option("--threads", options.bench.threads, "Threads")->capture_default_str()->check(CLI::Range(1, 1024));
  CLI::App* new_command = add("new", "Write a project for a part of your own, ready to build", start_project);
  new_command->add_option("kind", options.kind, "kinematics, stabilization, material, damage, influence, term or integrator")->required();
  new_command->add_option("name", options.part, "Its name, and that of the folder")->required();
  new_command->add_flag("--history", options.history, "A material that remembers: variables of its own at each evaluation point, and dissipated energy");
  add("contract", "Run the contract suites on every part of a library", contract)
      ->add_option("library", options.library, "Library of parts (FILE.so)")->required();
  add("list", "List the known parts", list)
      ->add_option("kind", options.kind, "kinematics, stabilization, material, damage, influence, term or integrator");
  CLI::App* describe_command =
      add("describe", "Describe a part: parameters, equations, source, limits; or the keys of scenes and studies", describe);
  describe_command->add_option("part", options.part, "KIND/NAME, e.g. material/hencky; scene, or scene/SECTION, e.g. scene/output; study");
  describe_command->add_flag("--markdown", options.markdown, "The reference page: everything, as Markdown");
}

/// The message of the parser, and where it says no more than that a word is missing, which command was meant.
int refuse(const CLI::App& app, const CLI::ParseError& error, const std::string& word) {
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
  if (std::ranges::find(commands, word) == commands.end() && !word.starts_with('-')) {
    tell(fmt::format("found the unknown command '{}'; allowed: {}{}\n", word, fmt::join(commands, ", "),
                     did_you_mean(word, commands)));
  } else {
    tell(fmt::format("{}\nHelp: perikit {}--help\n", error.what(), word.starts_with('-') ? "" : word + " "));
  }
  return input_refused;
}

}  // namespace

std::optional<int> read_command_line(int argc, char** argv, Options& options) {
  CLI::App app{"perikit: runtime-loaded parts for correspondence peridynamics", "perikit"};
  app.set_version_flag("--version", version());
  app.require_subcommand(1);
  add_commands(app, options);
  if (argc < 2) {
    tell(app.help());
    return input_refused;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForAllHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForVersion& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    return refuse(app, e, argv[1]);
  }
  return std::nullopt;
}

}  // namespace perikit::app
