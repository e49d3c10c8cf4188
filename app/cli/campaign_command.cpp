#include "app/cli/campaign_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "app/campaign/campaign.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/cli/small_commands.hpp"
#include "app/config/load_config.hpp"
#include "platform/journal/journal.hpp"
#include "platform/linux/child_process.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

constexpr int kJobsMax = 1024;
constexpr double kCellLimitMax_s = 1e6;
constexpr std::int64_t kSeedMax = std::int64_t{1} << 53;  // as config_keys.cpp
constexpr std::size_t kProgramBytesMax = std::size_t{4} << 30;

Status check_numbers(const CampaignCommandOptions& o) {
  if (o.cells < 1 || o.cells > kCellsMax) return failure(Fault::kUsage, "--cells {}: 1 to {}", o.cells, kCellsMax);
  if (o.first_seed < 0 || o.first_seed > kSeedMax - o.cells)
    return failure(Fault::kUsage, "--seed {}: 0 to {} for {} cells", o.first_seed, kSeedMax - o.cells, o.cells);
  if (o.jobs < 0 || o.jobs > kJobsMax) return failure(Fault::kUsage, "--jobs {}: 1 to {}", o.jobs, kJobsMax);
  if (!(o.cell_limit_s > 0 && o.cell_limit_s <= kCellLimitMax_s))
    return failure(Fault::kUsage, "--cell-limit {}: above 0, at most {} s", o.cell_limit_s, kCellLimitMax_s);
  if (o.kept_max < 0) return failure(Fault::kUsage, "--keep {}: 0 or more", o.kept_max);
  if (o.merge && !o.shard.empty()) return failure(Fault::kUsage, "--merge puts all shards together: without --shard");
  return {};
}

/// "campaigns/seed-1", "campaigns/seed-1-depth.drop=0.05"
std::string default_folder(const CampaignCommandOptions& options) {
  return fmt::format("campaigns/seed-{}{}{}", options.first_seed, options.faults.empty() ? "" : "-", options.faults);
}

Result<CampaignOptions> campaign_options(const CampaignCommandOptions& options) {
  if (Status fine = check_numbers(options); !fine) return std::unexpected(fine.error());
  CampaignOptions campaign;
  campaign.list = {options.first_seed, options.cells, options.faults};
  if (!options.shard.empty()) {
    Result<Shard> shard = parse_shard(options.shard);
    if (!shard) return std::unexpected(shard.error());
    campaign.shard = *shard;
  }
  campaign.folder = options.out.empty() ? default_folder(options) : options.out;
  campaign.jobs = options.jobs > 0 ? options.jobs : usable_processors();
  campaign.cell_limit_s = options.cell_limit_s;
  campaign.kept_max = options.kept_max;
  campaign.merge = options.merge;
  return campaign;
}

std::string checksum(std::span<const std::byte> bytes) { return fmt::format("{:08x}", crc32(0, bytes)); }

/// What the cells' processes will be: this program, with the configuration that they will find.
Result<CampaignIdentity> identity_of(const CellList& list) {
  ConfigSources sources;
  sources.environment = process_environment();
  sources.flags = {{"cell", fmt::format("random:{}", list.first_seed), "--cell"},
                   {"seed", std::to_string(list.first_seed), "--seed"},
                   {"workers", "1", "--workers"}};
  const Result<LoadedConfig> loaded = load_config(sources);
  if (!loaded) return std::unexpected(loaded.error());
  const Result<std::vector<std::byte>> program = read_file(kOwnProgram, kProgramBytesMax);
  if (!program) return std::unexpected(program.error());
  const std::string configuration = print_config(loaded->config);
  CampaignIdentity identity;
  identity.first_seed = list.first_seed;
  identity.faults = list.faults;
  identity.program = fmt::format("{}-{}", version_text(), checksum(*program));
  identity.configuration = checksum(std::as_bytes(std::span(configuration)));
  return identity;
}

std::string summary_file(const CampaignCommandOptions& options, const CampaignOptions& campaign) {
  if (!options.json.empty()) return options.json;
  const Shard& shard = campaign.shard;
  return (campaign.folder /
          (shard.whole() ? "summary.json" : fmt::format("summary-{}-of-{}.json", shard.number, shard.count)))
      .string();
}

int exit_code_of(const CampaignEnd& end) {
  if (end.cells.broken() > 0) return kExitInternal;
  if (end.interrupted) return kExitStopped;
  return end.cells.missing() > 0 ? kExitData : kExitDone;
}

void narrate_end(const CampaignEnd& end, Narrator& narrator) {
  if (end.cells.missing() == 0) return;
  narrator.line(fmt::format(
      "{}: {} of {} cells are finished; {}", end.interrupted ? "stopped" : "incomplete", end.cells.finished.size(),
      end.cells.asked(), end.interrupted ? "the same command goes on" : "the command without --merge runs the rest"));
}

Result<int> campaign(const CampaignCommandOptions& options) {
  const Result<CampaignOptions> checked = campaign_options(options);
  if (!checked) return std::unexpected(checked.error());
  const Result<CampaignIdentity> identity = identity_of(checked->list);
  if (!identity) return std::unexpected(identity.error());
  const bool to_stdout = options.json == "-";
  if (!options.json.empty() && !to_stdout) {  // said now, not after hours
    if (const auto probe = AtomicFile::create(options.json); !probe) return std::unexpected(probe.error());
  }
  Narrator narrator;
  narrator.line(fmt::format("{} cells in {}, {} at once", checked->list.indices(checked->shard).size(),
                            checked->folder.string(), checked->jobs));
  catch_stop_signals();
  const Result<CampaignEnd> end = run_campaign(*checked, *identity, narrator);
  if (!end) return std::unexpected(end.error());
  const std::string json = summary_json(end->cells);
  if (to_stdout) {
    std::fputs(summary_table(end->cells).c_str(), stderr);
    std::fputs(json.c_str(), stdout);
  } else {
    const std::string file = summary_file(options, *checked);
    if (Status written = write_file_atomically(file, json); !written) return std::unexpected(written.error());
    std::fputs(summary_table(end->cells).c_str(), stdout);
    narrator.line(fmt::format("summary   {}", file));
  }
  narrate_end(*end, narrator);
  return exit_code_of(*end);
}

}  // namespace

int run_campaign_command(const CampaignCommandOptions& options) {
  const Result<int> code = campaign(options);
  if (code) return *code;
  std::fprintf(stderr, "firstlook: %s\n", describe(code.error()).c_str());
  return code.error().fault == Fault::kUsage ? kExitUsage : kExitData;
}

}  // namespace firstlook
