#include "hal/ur/control_script.hpp"

#include <fmt/format.h>

#include "hal/ur/control_protocol.hpp"

namespace firstlook::ur {
namespace {

// URScript of 3.x and 5.x. The words between signs of per cent are filled in. What the URCap needs to use a program
// more than once stands between its marks: declarations in the header, what happens in the loop.
constexpr std::string_view kText = R"script(# HEADER_BEGIN
# firstlook's program on the robot. It moves the arm by what firstlook commands, segment by segment, and stops it when
# firstlook says so or is not heard for %READ_S% s. Changing it is not foreseen: firstlook refuses what it does not know.
global fl_target = [0, 0, 0, 0, 0, 0]
global fl_speed = 0
global fl_acceleration = 0
global fl_segment = 0
global fl_done = 0
global fl_texts = False

# A command is whole and in its place: it begins with its mark, and its sum is right.
def fl_whole(c):
  local i = 1
  local sum = 0
  while i < %NUMBERS%:
    sum = sum + c[i]
    i = i + 1
  end
  return c[1] == %MARK% and sum == c[%NUMBERS%]
end

def fl_say(kind, number):
  socket_send_int(kind, "firstlook")
  socket_send_int(number, "firstlook")
end

thread fl_move():
  movej(fl_target, a=fl_acceleration, v=fl_speed)
  fl_done = fl_segment
end

# Lines of text for the log of the pendant.
thread fl_show():
  if socket_open("%HOST%", %PORT%, "firstlook_text"):
    socket_send_int(%SAY_TEXT%, "firstlook_text")
    socket_send_int(%PROTOCOL%, "firstlook_text")
    while fl_texts:
      fl_line = socket_read_line("firstlook_text", 1)
      if fl_line != "":
        textmsg("firstlook: ", fl_line)
      end
      sync()
    end
  end
  socket_close("firstlook_text")
end
# HEADER_END

# NODE_CONTROL_LOOP_BEGINS
fl_segment = 0
fl_done = 0
fl_tries = 0
fl_connected = socket_open("%HOST%", %PORT%, "firstlook")
while not fl_connected and fl_tries < 5:
  fl_tries = fl_tries + 1
  sleep(0.2)
  fl_connected = socket_open("%HOST%", %PORT%, "firstlook")
end
if not fl_connected:
  popup("No firstlook at %HOST%, port %PORT%. Start it on the cart's computer, check the cable, then press Play.", title="firstlook", error=True, blocking=True)
else:
  fl_texts = True
  fl_show_thread = run fl_show()
  fl_moving = False
  fl_going = True
  fl_move_thread = 0
  fl_wait = 2
  fl_say(%SAY_HELLO%, %PROTOCOL%)
  while fl_going:
    fl_c = socket_read_binary_integer(%NUMBERS%, "firstlook", fl_wait)
    fl_wait = %READ_S%
    if fl_c[0] != %NUMBERS%:
      textmsg("firstlook: nothing heard from it: the arm stops")
      fl_going = False
    elif not fl_whole(fl_c):
      textmsg("firstlook: a command that is none: the arm stops")
      fl_going = False
    elif fl_c[2] == %MOVE%:
      if fl_moving:
        kill fl_move_thread
        stopj(%STOP%)
      end
      fl_target = [fl_c[4] / 1000000.0, fl_c[5] / 1000000.0, fl_c[6] / 1000000.0, fl_c[7] / 1000000.0, fl_c[8] / 1000000.0, fl_c[9] / 1000000.0]
      fl_speed = fl_c[10] / 1000000.0
      fl_acceleration = fl_c[11] / 1000000.0
      fl_segment = fl_c[3]
      fl_done = 0
      fl_moving = True
      fl_say(%SAY_ACCEPTED%, fl_segment)
      fl_move_thread = run fl_move()
    elif fl_c[2] == %HALT%:
      if fl_moving:
        kill fl_move_thread
      end
      stopj(%STOP%)
      fl_moving = False
      fl_done = 0
      fl_say(%SAY_STOPPED%, fl_c[3])
    elif fl_c[2] == %END%:
      fl_going = False
    elif fl_c[2] == %REFUSE%:
      fl_going = False
      popup("This program is not of the firstlook that runs on the cart. Get it anew: with the External Control URCap press Stop, then Play; a script file is written by: firstlook ur-script", title="firstlook", error=True, blocking=True)
    end
    if fl_moving and fl_done != 0:
      fl_moving = False
      fl_say(%SAY_DONE%, fl_done)
      fl_done = 0
    end
  end
  if fl_moving:
    kill fl_move_thread
    stopj(%STOP%)
  end
  fl_texts = False
  socket_close("firstlook")
  kill fl_show_thread
  socket_close("firstlook_text")
end
# A program that is set to loop forever would connect again by itself: only a person may begin.
halt
# NODE_CONTROL_LOOP_ENDS
)script";

struct Blank {
  std::string_view word;
  std::string value;
};

template <typename Kind>
std::string number_of(Kind kind) {
  return fmt::format("{}", static_cast<std::int32_t>(kind));
}

}  // namespace

std::string control_script(std::string_view host, std::uint16_t port) {
  const Blank blanks[] = {
      {"%HOST%", std::string(host)},
      {"%PORT%", fmt::format("{}", port)},
      {"%READ_S%", fmt::format("{}", kScriptRead_s)},
      {"%STOP%", fmt::format("{:.1f}", kScriptStop_rad_s2)},
      {"%PROTOCOL%", fmt::format("{}", kControlProtocol)},
      {"%MARK%", fmt::format("{}", kCommandMark)},
      {"%NUMBERS%", fmt::format("{}", kCommandNumbers)},
      {"%MOVE%", number_of(CommandKind::kMove)},
      {"%HALT%", number_of(CommandKind::kStop)},
      {"%END%", number_of(CommandKind::kEnd)},
      {"%REFUSE%", number_of(CommandKind::kRefuse)},
      {"%SAY_HELLO%", number_of(ReportKind::kHello)},
      {"%SAY_TEXT%", number_of(ReportKind::kText)},
      {"%SAY_ACCEPTED%", number_of(ReportKind::kAccepted)},
      {"%SAY_DONE%", number_of(ReportKind::kDone)},
      {"%SAY_STOPPED%", number_of(ReportKind::kStopped)},
  };
  std::string text(kText);
  for (const Blank& blank : blanks) {
    for (std::size_t at = text.find(blank.word); at != std::string::npos; at = text.find(blank.word, at)) {
      text.replace(at, blank.word.size(), blank.value);
    }
  }
  return text;
}

}  // namespace firstlook::ur
