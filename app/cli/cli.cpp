#include "app/cli/cli.hpp"

#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

#include "algorithms/calibration/solvers/solver_table.hpp"
#include "app/shell/job_settings.hpp"

namespace firstlook {
namespace {

/// Options that more than one command has, before they become sources of the configuration.
struct ConfigFlags {
  std::string file, cell, seed, workers;

  void add_to(CLI::App& app) {
    app.add_option("--config", file, "configuration file (YAML)");
    app.add_option(
        "--cell", cell,
        "simulated cell: empty, workshop, machine_tending, cluttered, hall, two_joint, pr2_like, random:SEED, or a "
        "file");
    app.add_option("--seed", seed, "seed of all random numbers");
    app.add_option("--workers", workers, "threads of one job (1 to 4); results do not depend on it");
  }
  [[nodiscard]] ConfigSources sources() const {
    ConfigSources s;
    if (!file.empty()) s.file = file;
    s.environment = process_environment();
    if (!cell.empty()) s.flags.push_back({"cell", cell, "--cell"});
    if (!seed.empty()) s.flags.push_back({"seed", seed, "--seed"});
    if (!workers.empty()) s.flags.push_back({"workers", workers, "--workers"});
    return s;
  }
};

CLI::App* add_campaign(CLI::App& app, CampaignCommandOptions& campaign) {
  CLI::App* added = app.add_subcommand("campaign", "the job in many random cells, each in a process of its own");
  added->add_option("--cells", campaign.cells, "how many; cell i is random:(S+i) with seed S+i and the fast sensor")
      ->required();
  added->add_option("--seed", campaign.first_seed, "S, of the first cell")->capture_default_str();
  added->add_option("--jobs", campaign.jobs, "processes at once (default: one for each processor)");
  added->add_option("--shard", campaign.shard, "I/N: of the cells only those whose number i leaves I-1 divided by N");
  added->add_option("--faults", campaign.faults, "what goes wrong in every cell, as in `run`");
  added->add_option("--json", campaign.json,
                    "file for the summary, or - for stdout (default summary.json in the folder)");
  added->add_option("--out", campaign.out,
                    "folder of the finished cells and of kept runs; the same command goes on with what is in it "
                    "(default campaigns/seed-S, with the faults behind it)");
  added->add_flag("--merge", campaign.merge, "run nothing: the summary of what all shards have finished");
  added->add_option("--cell-limit", campaign.cell_limit_s, "seconds until a cell counts as hung and is ended")
      ->capture_default_str();
  added
      ->add_option("--keep", campaign.kept_max,
                   "run folders kept of cells that are not done, or touched or entered what they must not")
      ->capture_default_str();
  added->footer(
      "Exit codes: 0 every cell ended done, rejected or safely stopped with a reason, without contact and without "
      "entry "
      "into unknown space; 2 usage, 3 data, a full disk, or cells missing with --merge; 6 stopped by a signal (the "
      "same "
      "command goes on); 70 a contact, an entry, or a cell that crashed, hung, faulted or failed.");
  return added;
}

}  // namespace

ParsedCommandLine parse_command_line(int argc, const char* const* argv) {
  CLI::App app{
      "firstlook calibrates the camera on a robot arm and maps its cell, moving only through space that it has "
      "seen to be free."};
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 2 usage, 3 configuration or data, 4 device missing, 5 calibration rejected, 6 safely "
      "stopped, "
      "70 internal fault.");
  app.failure_message(CLI::FailureMessage::simple);

  RunCommand run;
  ConfigFlags run_flags;
  std::string only = "everything", sensor = "full", calibration, prior, views, robot;
  CLI::App* run_app = app.add_subcommand("run", "the whole job or a part of it, in a simulated cell");
  run_flags.add_to(*run_app);
  run_app->add_option("--only", only, "a part of the job; map and verify test a stored calibration first")
      ->check(CLI::IsMember({"everything", "calibrate", "map", "verify"}));
  run_app->add_option("--calibration", calibration,
                      "hand_eye.yaml of an earlier run, for --only map and --only verify");
  run_app->add_option("--prior-map", prior,
                      "an earlier map of the cell, .bt or .ot: where to look first, and what changed");
  run_app
      ->add_option("--views", views,
                   "how the views for the map are chosen; thesis2014: as in the thesis of 2014, to measure against")
      ->check(CLI::IsMember({"firstlook", "thesis2014"}));
  run_app->add_option("--sensor", sensor, "full pictures, or fast: coarser depth and projected corners")
      ->check(CLI::IsMember({"full", "fast"}));
  run_app->add_option("--out", run.out, "folder of the run (default runs/<date>-<seed>); must be new or empty");
  run_app->add_option("--faults", run.faults, "what goes wrong, e.g. depth.drop=0.05,operator.pause_at=20:5");
  run_app->add_option(
      "--robot", robot,
      "who moves the arm (robot.host): auto, as it is: a simulated Universal Robots controller in this process "
      "where the cell's arm is a UR, else the cell itself; simulated: always such a controller; none: always the "
      "cell itself; or the address of a controller, at the pace of the clock, where what the cameras see of it is "
      "simulated by `firstlook ur-sim --cell ...` there, with --lockstep in virtual time");
  run_app
      ->add_option("--robot-at", run.robot_happens,
                   "SECONDS=WHAT happens to the simulated controller, such as 20=reboot; may be repeated; "
                   "`firstlook ur-sim --at help` tells what can")
      ->allow_extra_args(false);
  run_app->add_flag("--record", run.record,
                    "keep the views of the board as a dataset that `firstlook calibrate` reads");
  run_app->add_flag("--resume", run.resume,
                    "take up the newest run below runs/ that was cut off after its calibration: test that calibration, "
                    "then map; without one, the whole job");
  run_app->add_flag("--real-time", run.real_time, "at the pace of the clock instead of virtual time");
  run_app->add_flag("--json", run.json, "print result.json on stdout at the end");

  CalibrateCommandOptions calibrate;
  CLI::App* calibrate_app = app.add_subcommand("calibrate", "hand-eye calibration from recorded data");
  calibrate_app->add_option("--dataset", calibrate.dataset, "folder with board.yaml and poses.csv or pairs.csv")
      ->required();
  calibrate_app->add_option(
      "--solver", calibrate.solver,
      fmt::format("what starts the refinement (park-martin): {}", fmt::join(solver_names(), ", ")));
  calibrate_app
      ->add_option("--detector", calibrate.detector,
                   "settings of the checkerboard's detection: default, thesis2014 (table D-8), ...")
      ->capture_default_str();
  calibrate_app
      ->add_option(
          "--intrinsics", calibrate.intrinsics,
          "given: take camera_info.yaml as exact; estimate: solve for the camera's intrinsics together with the "
          "rest (what happens without camera_info.yaml)")
      ->check(CLI::IsMember({"given", "estimate"}));
  calibrate_app->add_option(
      "--out", calibrate.out,
      "folder for report.html, result.json, hand_eye.yaml, camera_info.yaml and ros/; must be new "
      "or empty");
  calibrate_app
      ->add_option("--arm", calibrate.arm,
                   "the arm that the data are of, so that a later job may take up hand_eye.yaml: ur3, ur5, ur10, ur3e, "
                   "ur5e, ur10e")
      ->check(CLI::IsMember({"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}));
  calibrate_app->add_flag("--strict", calibrate.strict, "exit with 5 when the calibration is rejected");
  calibrate_app->add_flag("--json", calibrate.json, "print the hand_eye object on stdout");

  MapCommandOptions map;
  std::vector<std::string> map_datasets;
  std::string map_from, map_prior, map_out;
  CLI::App* map_app = app.add_subcommand("map", "a map from recorded depth frames or a file, and what is in it");
  map_app
      ->add_option("--dataset", map_datasets,
                   "folder in TUM RGB-D layout; several, one for each sensor: --dataset A --dataset B")
      ->allow_extra_args(false);
  map_app->add_option("--from", map_from, "a stored map instead: .bt or .ot");
  map_app->add_option("--resolution", map.resolution_m, "voxel size in metres")->capture_default_str();
  map_app->add_option("--max-range", map.range_max_m, "rays are cut here, metres")->capture_default_str();
  map_app->add_flag("--sort", map.sort, "depth.txt is not in the order of time: sort it, instead of refusing frames");
  map_app->add_option("--prior-map", map_prior, "an earlier map, .bt or .ot: say what changed since");
  map_app
      ->add_option("--planes", map.planes,
                   "what to keep for each voxel of a dataset's map, with commas between: color (from rgb.txt), label "
                   "(the object), sensor (that saw it last)")
      ->capture_default_str();
  map_app->add_flag("--objects", map.objects, "list connected occupied voxels as planes, boxes and others");
  map_app
      ->add_option("--move", map.moves,
                   "ID,dx,dy,dz: move an object of --objects, metres; what it uncovers becomes unknown")
      ->allow_extra_args(false);
  map_app->add_option("--at", map.at, "X,Y,Z: what is known of a place, metres");
  map_app->add_option(
      "--out", map_out,
      "folder for collision_map.bt, map.ot, map.ply; frames.csv of a dataset; objects.png; with colours "
      "color_map.ot, color.png");
  map_app->add_option("--depth", map.depth, "cut the trees of --out at this depth: 16 whole, 15 twice as coarse ..")
      ->capture_default_str();
  map_app->add_flag("--json", map.json, "print the counts as JSON");

  ExportCommandOptions export_options;
  std::string export_run, export_out;
  CLI::App* export_app = app.add_subcommand("export", "what a run found, in the files of other programs");
  export_app->add_option("run", export_run, "folder of a run, or of `firstlook map --out`")->required();
  export_app
      ->add_option("--to", export_options.to,
                   "ros2, ros1: calibration, and the map as octomap message; moveit: scenes; ur: URScript; csv: tables")
      ->required()
      ->check(CLI::IsMember({"ros2", "ros1", "moveit", "ur", "csv"}));
  export_app->add_option("--out", export_out, "folder for the files (default RUN/export/TO)");

  BoardCommandOptions board;
  CLI::App* board_app = app.add_subcommand("board", "a printable target at true size");
  const auto types = target_type_names(), dictionaries = dictionary_names();
  board_app->add_option("--type", board.words.type, "kind of target")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(types.begin(), types.end())));
  board_app->add_option("--columns", board.words.columns, "inner corners, circles or markers along a row")
      ->capture_default_str();
  board_app->add_option("--rows", board.words.rows, "the same along a column")->capture_default_str();
  board_app
      ->add_option("--size", board.words.spacing_m,
                   "metres from neighbour to neighbour: side of a square, or of a single marker")
      ->capture_default_str();
  board_app->add_option("--mark-size", board.words.mark_size_m,
                        "side of a marker or diameter of a circle, metres (default: usual part of --size)");
  board_app->add_option("--dictionary", board.words.dictionary, "family of the markers")
      ->check(CLI::IsMember(std::vector<std::string>(dictionaries.begin(), dictionaries.end())))
      ->capture_default_str();
  board_app->add_option("--first-id", board.words.first_id, "number of the first marker")->capture_default_str();
  board_app->add_flag("--legacy", board.words.legacy, "ChArUco as OpenCV drew it before 4.6");
  board_app->add_option("--page", board.page,
                        "A4, A3, letter, or WIDTHxHEIGHT in mm (default: the smallest that fits)");
  board_app->add_option("-o,--out", board.out, "file to write")->capture_default_str();

  CampaignCommandOptions campaign;
  CLI::App* campaign_app = add_campaign(app, campaign);
  UrSimCommand ur_sim;
  CLI::App* ur_sim_app = app.add_subcommand(
      "ur-sim",
      "a simulated Universal Robots controller on TCP: RTDE, dashboard, primary, secondary, realtime, interpreter");
  ur_sim_app
      ->add_option("--model", ur_sim.model, "ur3, ur5, ur10 (CB3, 3.15, 125 Hz); ur3e, ur5e, ur10e (5.12, 500 Hz)")
      ->check(CLI::IsMember({"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}))
      ->capture_default_str();
  ur_sim_app->add_option("--host", ur_sim.host, "address to listen on; 0.0.0.0: every one of this computer")
      ->capture_default_str();
  ur_sim_app
      ->add_option("--port-offset", ur_sim.port_offset,
                   "added to the ports 29999, 30001 to 30004, 30011 to 30013, 30020 (e-Series), 30098")
      ->check(CLI::Range(-29000, 35500))
      ->capture_default_str();
  ur_sim_app
      ->add_option("--seed", ur_sim.seed,
                   "draws the arm's factory correction; 0: the published kinematics. With --cell: as of the run there")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{INT64_MAX}))
      ->capture_default_str();
  ur_sim_app->add_option("--serial", ur_sim.serial, "serial number (default: made up from the seed)");
  ur_sim_app->add_flag("--running", ur_sim.running, "start with the brakes released instead of without power");
  ur_sim_app
      ->add_option("--program", ur_sim.programs,
                   "URScript file that `load` of the dashboard finds under its name, ending in .urp; may be repeated")
      ->allow_extra_args(false);

  ur_sim_app->add_option(
      "--external-control", ur_sim.external_control,
      "HOST or HOST:PORT (50002): whom the program external_control.urp asks for its script at Play");

  ur_sim_app->add_option(
      "--cell", ur_sim.cell,
      "simulated cell whose arm this is: it stands as the cell's does, and tells its true joints to "
      "the cameras of `firstlook run --robot`; --seed as there, and the robot that belongs to the cell");
  ur_sim_app->add_option("--play-after", ur_sim.play_after_s,
                         "so many seconds after the start somebody presses Play on external_control.urp, again every "
                         "3 s until it runs; with --lockstep once, in the job's time, 0.5 if not given");
  ur_sim_app
      ->add_flag("--lockstep", ur_sim.lockstep,
                 "with --cell: the robot's time is the virtual one of `firstlook run --robot`, so that a run of two "
                 "processes gives the same bytes as one")
      ->needs(ur_sim_app->get_option("--cell"));
  ur_sim_app
      ->add_option(
          "--at", ur_sim.happens,
          "SECONDS=WHAT: what happens to the robot so long after the start, in the job's time with --lockstep, "
          "such as 20=emergency-stop; may be repeated; help: what can happen")
      ->allow_extra_args(false);
  ur_sim_app->add_flag("--console", ur_sim.console,
                       "what happens to the robot by lines on stdin, as always by lines to the port 30098");
  UrScriptCommand ur_script;
  CLI::App* ur_script_app =
      app.add_subcommand("ur-script", "the robot's program as a file, for pendants without the External Control URCap");
  ur_script_app->add_option("--host", ur_script.host, "address of this computer as the controller sees it")->required();
  ur_script_app->add_option("--port", ur_script.port, "robot.control_port")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  ur_script_app->add_option("-o,--out", ur_script.out, "file to write; -: stdout")->capture_default_str();

  CheckCommand check;
  ConfigFlags check_flags;
  CLI::App* check_app = app.add_subcommand(
      "check",
      "asks every device, one line each, and says what to do; those of a simulated cell where none is configured");
  check_flags.add_to(*check_app);
  check_app->add_flag("--json", check.json, "print what was found as JSON");
  check_app->footer(
      "Exit codes: 0 all are ready, 3 configuration, 4 a device is missing, lost or another than expected.");

  BundleCommandOptions bundle;
  std::string bundle_config;
  CLI::App* bundle_app = app.add_subcommand("bundle", "a run for support: its files, configuration, versions, status");
  bundle_app->add_option("run", bundle.folder, "folder of a run")->required();
  bundle_app->add_option("-o,--out", bundle.out, "archive to write (default RUN.tar.gz in the working directory)");
  bundle_app->add_option("--config", bundle_config, "configuration file (YAML) of the cart");

  ReplayCommand replay;
  CLI::App* replay_app = app.add_subcommand("replay", "run a journal's events again and compare every decision");
  replay_app->add_option("journal", replay.journal, "journal.flj of a run")->required();

  CLI::App* states_app = app.add_subcommand("states", "the state machine as a Mermaid diagram");
  ExplainCommand explain;
  CLI::App* explain_app = app.add_subcommand("explain", "what a fault code means and what to do");
  explain_app->add_option("code", explain.code, "E2005, or 2005")->required();

  ConfigCommandOptions config;
  ConfigFlags config_flags;
  CLI::App* config_app = app.add_subcommand("config",
                                            "what file, environment and flags say, as commented YAML; a simulated cell "
                                            "sets arm.model, safe_zone, cart, board and depth itself");
  config_flags.add_to(*config_app);
  config_app->add_flag("--defaults", config.defaults, "the defaults alone");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return {std::nullopt, code == 0 ? 0 : 2};
  }
  if (run_app->parsed()) {
    run.sources = run_flags.sources();
    run.cell_given = !run_flags.cell.empty();
    run.scope = *find_scope(only);
    if (!calibration.empty()) {
      if (run.scope != RunScope::kMap && run.scope != RunScope::kVerify) {
        fmt::print(stderr, "--calibration: only --only map and --only verify use a stored calibration\n");
        return {std::nullopt, 2};
      }
      run.sources.flags.push_back({"calibration.stored", calibration, "--calibration"});
    }
    if (!views.empty()) run.sources.flags.push_back({"explore.views", views, "--views"});
    if (!robot.empty()) run.sources.flags.push_back({"robot.host", robot, "--robot"});
    if (!prior.empty()) run.sources.flags.push_back({"map.prior", prior, "--prior-map"});
    run.fast_sensor = sensor == "fast";
    return {run, 0};
  }
  if (calibrate_app->parsed()) return {calibrate, 0};
  if (map_app->parsed()) {
    map.datasets.assign(map_datasets.begin(), map_datasets.end());
    map.from = map_from;
    map.prior = map_prior;
    map.out = map_out;
    return {map, 0};
  }
  if (export_app->parsed()) {
    export_options.run = export_run;
    export_options.out = export_out;
    return {export_options, 0};
  }
  if (board_app->parsed()) return {board, 0};
  if (campaign_app->parsed()) return {campaign, 0};
  if (ur_sim_app->parsed()) return {ur_sim, 0};
  if (ur_script_app->parsed()) return {ur_script, 0};
  if (check_app->parsed()) {
    check.sources = check_flags.sources();
    return {check, 0};
  }
  if (bundle_app->parsed()) {
    if (!bundle_config.empty()) bundle.sources.file = bundle_config;
    bundle.sources.environment = process_environment();
    return {bundle, 0};
  }
  if (replay_app->parsed()) return {replay, 0};
  if (states_app->parsed()) return {StatesCommand{}, 0};
  if (explain_app->parsed()) return {explain, 0};
  config.sources = config_flags.sources();
  return {config, 0};
}

}  // namespace firstlook
