#include "hal/ur/program_link.hpp"

#include <algorithm>

namespace firstlook::ur {
namespace {
constexpr std::string_view kRequest = "request_program\n";
}

ProgramLink::~ProgramLink() {
  close();
  for (Visitor& visitor : visitors_) drop(visitor.link);
}

void ProgramLink::drop(LinkId& link) {
  if (link != kNoLink) network_.close(link);
  link = kNoLink;
}

void ProgramLink::close() {
  drop(commands_.link);
  drop(texts_.link);
}

void ProgramLink::poll(Instant now) {
  let_in(now, Door::kProgram);
  let_in(now, Door::kControl);
  for (Visitor& visitor : visitors_) {
    if (visitor.link != kNoLink) hear(now, visitor);
  }
  if (texts_.link != kNoLink) {
    receive_into(texts_.inbox, network_, texts_.link);
    texts_.inbox.clear();  // it says nothing; reading shows its end
    if (network_.state(texts_.link) == LinkState::kClosed) drop(texts_.link);
  }
  if (commands_.link == kNoLink) return;
  receive_into(commands_.inbox, network_, commands_.link);
  if (network_.state(commands_.link) == LinkState::kClosed && commands_.inbox.view().size() < ProgramReport::kBytes) {
    close();
  }
}

void ProgramLink::let_in(Instant now, Door door) {
  for (Visitor& visitor : visitors_) {
    if (visitor.link != kNoLink) continue;
    visitor.link = network_.accept(door);
    if (visitor.link == kNoLink) return;
    visitor.inbox.clear();
    visitor.door = door;
    visitor.until = now + kIntroduction;
  }
}

void ProgramLink::hear(Instant now, Visitor& visitor) {
  receive_into(visitor.inbox, network_, visitor.link);
  if (visitor.door == Door::kProgram) {
    if (visitor.inbox.view().starts_with(kRequest)) {
      network_.send(visitor.link, script_);
      asked_ = now;
      return drop(visitor.link);  // its end says that this was all
    }
  } else if (visitor.inbox.view().size() >= ProgramReport::kBytes) {
    return introduce(visitor);
  }
  if (now >= visitor.until || network_.state(visitor.link) == LinkState::kClosed) drop(visitor.link);
}

void ProgramLink::introduce(Visitor& visitor) {
  const ProgramReport hello = *cut_report(visitor.inbox.view());
  const bool speaks = hello.kind == ReportKind::kHello || hello.kind == ReportKind::kText;
  if (speaks && hello.number != kControlProtocol) {
    if (notices_ != nullptr) {
      std::array<char, 160> line;
      const auto end =
          fmt::format_to_n(line.data(), line.size(),
                           "the robot's program speaks protocol {}, firstlook {}: refused; get the program "
                           "anew from `firstlook ur-script`",
                           hello.number, kControlProtocol);
      notices_->notice({line.data(), std::min(end.size, line.size())});
    }
    if (hello.kind == ReportKind::kHello) network_.send(visitor.link, plain_command(CommandKind::kRefuse, 0).view());
  }
  if (!speaks || hello.number != kControlProtocol) return drop(visitor.link);
  visitor.inbox.use_up(ProgramReport::kBytes);
  if (hello.kind == ReportKind::kHello) {
    close();
    commands_ = visitor;
    ++programs_;
  } else {
    drop(texts_.link);
    texts_ = visitor;
    send_line();
  }
  visitor.link = kNoLink;
}

std::optional<ProgramReport> ProgramLink::take() {
  if (!up()) return std::nullopt;
  const auto report = cut_report(commands_.inbox.view());
  if (report) commands_.inbox.use_up(ProgramReport::kBytes);
  return report;
}

bool ProgramLink::send(const Command& command) {
  if (!up()) return false;
  if (network_.send(commands_.link, command.view())) return true;
  close();
  return false;
}

void ProgramLink::show(std::string_view line) {
  line_size_ = std::min(line.size(), kLineMax);
  std::copy_n(line.begin(), line_size_, line_.begin());
  std::replace(line_.begin(), line_.begin() + static_cast<std::ptrdiff_t>(line_size_), '\n', ' ');
  line_[line_size_++] = '\n';
  send_line();
}

void ProgramLink::send_line() {
  if (texts_.link == kNoLink || line_size_ == 0) return;
  if (!network_.send(texts_.link, {line_.data(), line_size_})) drop(texts_.link);
}

}  // namespace firstlook::ur
