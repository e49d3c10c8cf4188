#include "hal/ur/rtde_client.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook::ur {
namespace {

// What every controller from 3.0 on has, and what is asked for besides.
constexpr std::string_view kNames =
    "timestamp,actual_q,actual_qd,robot_mode,safety_mode,runtime_state,speed_scaling,target_speed_fraction";
constexpr std::string_view kNamesWithPayload =
    "timestamp,actual_q,actual_qd,robot_mode,safety_mode,runtime_state,speed_scaling,target_speed_fraction,payload";
constexpr std::string_view kNamesWithGravity =
    "timestamp,actual_q,actual_qd,robot_mode,safety_mode,runtime_state,speed_scaling,target_speed_fraction,payload,"
    "target_gravity";
constexpr std::size_t kFields = 8;
constexpr RtdeType kTypes[kFields] = {RtdeType::kDouble, RtdeType::kVector6d, RtdeType::kVector6d, RtdeType::kInt32,
                                      RtdeType::kInt32,  RtdeType::kUint32,   RtdeType::kDouble,   RtdeType::kDouble};
constexpr std::size_t kValues = 22, kPayloadAt = 18, kGravityAt = 19;

std::string_view names_of(int extras) {
  constexpr std::string_view kAll[] = {kNames, kNamesWithPayload, kNamesWithGravity};
  return kAll[extras];
}

int whole(double value) { return std::isfinite(value) ? static_cast<int>(std::clamp(value, -1e6, 1e6)) : -1; }

}  // namespace

RtdeClient::~RtdeClient() {
  if (link_ != kNoLink) network_.close(link_);
}

void RtdeClient::dial(Instant now) {
  link_ = network_.dial(Service::kRtde);
  if (link_ == kNoLink) return;
  inbox_.clear();
  step_ = Step::kDialling;
  until_ = now + kDial;
}

void RtdeClient::give_up(Instant now, const Error& why) {
  trouble_ = why;
  ++counters_.broken;
  if (link_ != kNoLink) network_.close(link_);
  link_ = kNoLink;
  step_ = Step::kDown;
  until_ = now + redial_;
  redial_ = std::min(redial_ * 2, kRedialMax);
}

void RtdeClient::wait_for_answer(Instant now, Step step, const RtdeRequest& request) {
  network_.send(link_, request.view());
  step_ = step;
  until_ = now + kAnswer;
}

void RtdeClient::ask_outputs(Instant now) {
  wait_for_answer(now, Step::kOutputs, rtde_outputs_request(protocol_, frequency_hz_, names_of(extras_)));
}

std::optional<RtdeReport> RtdeClient::poll(Instant now) {
  if (step_ == Step::kDown) {
    if (now >= until_) dial(now);
    return std::nullopt;
  }
  const LinkState link = network_.state(link_);
  if (step_ == Step::kDialling && link == LinkState::kOpen) {
    protocol_ = 2;
    wait_for_answer(now, Step::kProtocol, rtde_protocol_request(2));
  }
  receive_into(inbox_, network_, link_);
  while (true) {
    const auto package = rtde_cut(inbox_.view());
    if (!package) {
      give_up(now, package.error());
      return std::nullopt;
    }
    if (!*package) break;
    const auto report = take(now, **package);
    if (step_ == Step::kDown) return std::nullopt;
    inbox_.use_up((*package)->bytes);
    if (report) return report;
  }
  if (inbox_.room().empty()) {
    give_up(now, failure(Fault::kLinkLost, "RTDE: a package larger than {} bytes", inbox_.view().size()).error());
  } else if (network_.state(link_) == LinkState::kClosed) {
    const char* what = step_ == Step::kDialling ? "nobody answers on its port 30004" : "the controller hung up";
    give_up(now, failure(Fault::kLinkLost, "RTDE: {}", what).error());
  } else if (now >= until_) {
    give_up(now, failure(Fault::kLinkLost, "RTDE: nothing came in time").error());
  }
  return std::nullopt;
}

std::optional<RtdeReport> RtdeClient::take(Instant now, const RtdePackage& package) {
  if (package.kind == RtdeKind::kText) return std::nullopt;  // remarks; what is wrong shows itself in the answers
  if (package.kind == RtdeKind::kData) {
    if (step_ != Step::kStreaming) return std::nullopt;
    std::array<double, kValues> values{};
    if (const Status read = rtde_values(recipe_, package.payload, values); !read) {
      give_up(now, read.error());
      return std::nullopt;
    }
    const RtdeReport report = report_of(values);
    if (!report.position_rad.all_finite() || !report.velocity_rad_s.all_finite() ||
        !std::isfinite(report.timestamp_s)) {
      give_up(now, failure(Fault::kLinkLost, "RTDE: joints or time that are no numbers").error());
      return std::nullopt;
    }
    until_ = now + kSilent;
    redial_ = kRedial;
    trouble_.reset();
    ++counters_.reports;
    return report;
  }
  if (const Status status = take_answer(now, package); !status) give_up(now, status.error());
  return std::nullopt;
}

Status RtdeClient::take_answer(Instant now, const RtdePackage& package) {
  const auto unexpected = [&] {
    return failure(Fault::kLinkLost, "RTDE: an answer '{}' that nobody asked for", static_cast<char>(package.kind));
  };
  switch (step_) {
    case Step::kProtocol: {
      if (package.kind != RtdeKind::kProtocol) return unexpected();
      const auto accepted = rtde_accepted(package.payload);
      if (!accepted) return std::unexpected(accepted.error());
      if (*accepted) {
        wait_for_answer(now, Step::kVersion, rtde_version_request());
      } else if (protocol_ == 2) {
        protocol_ = 1;
        wait_for_answer(now, Step::kProtocol, rtde_protocol_request(1));
      } else {
        return failure(Fault::kLinkLost, "RTDE: the controller speaks neither protocol 2 nor 1");
      }
      return {};
    }
    case Step::kVersion: {
      if (package.kind != RtdeKind::kVersion) return unexpected();
      const auto version = rtde_version(package.payload);
      if (!version) return std::unexpected(version.error());
      version_ = *version;
      ask_outputs(now);
      return {};
    }
    case Step::kOutputs:
      if (package.kind != RtdeKind::kOutputs) return unexpected();
      return take_outputs(now, package.payload);
    case Step::kStart: {
      if (package.kind != RtdeKind::kStart) return unexpected();
      const auto accepted = rtde_accepted(package.payload);
      if (!accepted) return std::unexpected(accepted.error());
      if (!*accepted) return failure(Fault::kLinkLost, "RTDE: the controller does not start to send");
      step_ = Step::kStreaming;
      until_ = now + kSilent;
      ++counters_.connections;
      return {};
    }
    default:
      return unexpected();
  }
}

Status RtdeClient::take_outputs(Instant now, std::string_view payload) {
  const auto recipe = rtde_recipe(protocol_, payload, names_of(extras_));
  if (!recipe) return std::unexpected(recipe.error());
  if (!recipe->complete() && extras_ > 0) {  // an older controller
    --extras_;
    ask_outputs(now);
    return {};
  }
  if (!recipe->complete()) {
    return failure(Fault::kLinkLost, "RTDE: the controller does not have all of: {}", kNames);
  }
  const bool types_right = std::equal(std::begin(kTypes), std::end(kTypes), recipe->types.begin());
  const bool payload_right = extras_ < 1 || recipe->types[kFields] == RtdeType::kDouble;
  const bool gravity_right = extras_ < 2 || recipe->types[kFields + 1] == RtdeType::kVector3d;
  if (!types_right || !payload_right || !gravity_right) {
    return failure(Fault::kLinkLost, "RTDE: outputs of other types than UR's guide has them");
  }
  recipe_ = *recipe;
  wait_for_answer(now, Step::kStart, rtde_start_request());
  return {};
}

RtdeReport RtdeClient::report_of(std::span<const double> values) const {
  RtdeReport report;
  report.timestamp_s = values[0];
  for (int j = 0; j < 6; ++j) {
    report.position_rad[j] = values[1 + static_cast<std::size_t>(j)];
    report.velocity_rad_s[j] = values[7 + static_cast<std::size_t>(j)];
  }
  report.robot_mode = whole(values[13]);
  report.safety_mode = whole(values[14]);
  const int runtime = whole(values[15]);
  if (runtime >= 0 && runtime < static_cast<int>(Runtime::kUnknown)) report.runtime = static_cast<Runtime>(runtime);
  report.speed_scaling = values[16];
  report.slider = values[17];
  if (extras_ >= 1) report.payload_kg = values[kPayloadAt];
  if (extras_ >= 2) report.gravity_m_s2 = {values[kGravityAt], values[kGravityAt + 1], values[kGravityAt + 2]};
  return report;
}

}  // namespace firstlook::ur
