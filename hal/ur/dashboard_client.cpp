#include "hal/ur/dashboard_client.hpp"

#include <algorithm>

namespace firstlook::ur {
namespace {

struct Row {
  std::string_view question, begins;  ///< what stands before the answer's own part
};
// In the order of DashboardClient::Question.
constexpr Row kRows[] = {
    {"get robot model\n", ""},      {"get serial number\n", ""},      {"PolyscopeVersion\n", "URSoftware "},
    {"robotmode\n", "Robotmode: "}, {"safetymode\n", "Safetymode: "}, {"programState\n", ""},
    {"is in remote control\n", ""}};

}  // namespace

DashboardClient::~DashboardClient() {
  if (link_ != kNoLink) network_.close(link_);
}

std::string_view DashboardClient::answer(Question question) const {
  const Answer& answer = answers_[static_cast<std::size_t>(question)];
  return {answer.text.data(), answer.size};
}

void DashboardClient::keep(std::string_view line) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (!greeted_) {
    greeted_ = true;
    return;
  }
  if (answered_ >= asked_) return;  // nobody asked
  const Row& row = kRows[answered_];
  Answer& answer = answers_[answered_++];
  if (line.starts_with("could not understand")) return;
  if (line.starts_with(row.begins)) line.remove_prefix(row.begins.size());
  answer.size = std::min(line.size(), kAnswerMax);
  std::copy_n(line.begin(), answer.size, answer.text.begin());
}

Result<bool> DashboardClient::poll(Instant now) {
  if (answered_ == kQuestions) return true;
  if (link_ == kNoLink) {
    link_ = network_.dial(Service::kDashboard);
    until_ = now + kDial;
    if (link_ == kNoLink) return failure(Fault::kLinkLost, "dashboard: no connection is left for it");
  }
  receive_into(inbox_, network_, link_);
  for (std::size_t end = inbox_.view().find('\n'); end != std::string_view::npos; end = inbox_.view().find('\n')) {
    keep(inbox_.view().substr(0, end));
    inbox_.use_up(end + 1);
  }
  if (inbox_.room().empty()) return failure(Fault::kLinkLost, "dashboard: a line without an end");
  if (greeted_ && asked_ == answered_ && asked_ < kQuestions) {
    network_.send(link_, kRows[asked_++].question);
    until_ = now + kAnswer;
  }
  if (answered_ == kQuestions) return true;
  if (network_.state(link_) == LinkState::kClosed) {
    return failure(Fault::kLinkLost, "dashboard: {}",
                   greeted_ ? "the controller hung up" : "nobody answers on port 29999");
  }
  if (now >= until_) return failure(Fault::kLinkLost, "dashboard: no answer in time");
  return false;
}

}  // namespace firstlook::ur
