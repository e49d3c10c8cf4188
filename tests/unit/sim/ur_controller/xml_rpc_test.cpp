/// Programs that call functions of other computers, answered byte by byte as servers do.
#include <catch2/catch.hpp>

#include "hal/sim/ur_controller/script/compiler.hpp"
#include "hal/sim/ur_controller/script/http_exchange.hpp"
#include "hal/sim/ur_controller/script/xml_rpc.hpp"
#include "tests/support/script_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using script::List;
using script::Value;

namespace {

/// A server that somebody dials again and again.
class RpcServer final : public script::Sockets {
 public:
  std::string host, sent, to_robot;
  std::uint16_t port = 0;
  bool reachable = true, open_now = false;
  int dialled = 0;

  Id open(const std::string& to, std::uint16_t to_port) override {
    host = to;
    port = to_port;
    sent.clear();
    to_robot.clear();
    open_now = reachable;
    return static_cast<Id>(++dialled);
  }
  [[nodiscard]] State state(Id socket) const override {
    return open_now && socket == static_cast<Id>(dialled) ? State::kOpen : State::kClosed;
  }
  bool send(Id, std::string_view bytes) override {
    sent += bytes;
    return true;
  }
  [[nodiscard]] std::string& received(Id) override { return to_robot; }
  void close(Id) override { open_now = false; }
};

std::string answer_of(const std::string& value) {
  return "<?xml version='1.0'?>\n<methodResponse>\n<params>\n<param>\n" + value +
         "\n</param>\n</params>\n</methodResponse>\n";
}

std::string http(const std::string& body, const std::string& headers = "") {
  return "HTTP/1.0 200 OK\r\nServer: test\r\n" + headers + "Content-length: " + std::to_string(body.size()) +
         "\r\n\r\n" + body;
}

struct RpcRobot : ScriptRobot {
  RpcServer server;
  RpcRobot() { robot.programs().set_sockets(&server); }
  ~RpcRobot() { robot.programs().set_sockets(nullptr); }
  RpcRobot(const RpcRobot&) = delete;
  RpcRobot& operator=(const RpcRobot&) = delete;
};

Value read(const std::string& value) {
  const auto got = script::read_xml_rpc_answer(answer_of(value));
  INFO((got ? std::string() : got.error()));
  REQUIRE(got);
  return *got;
}

}  // namespace

TEST_CASE("a program calls a function of another computer and has its answer", "[ur][script]") {
  RpcRobot robot;
  robot.send(
      "def prog():\n  global camera = rpc_factory(\"xmlrpc\", \"http://10.0.0.9:8080/RPC2\")\n"
      "  pose = camera.find(\"a<b\", 3, 2.5, True, [1, 2.0], p[1, 2, 3, 0, 0, 0.5])\n  textmsg(pose)\n"
      "  if not camera.more():\n    textmsg(\"no more\")\n  end\n  camera.closeXMLRPCClientConnection()\n"
      "  textmsg(\"over\")\n  sleep(1)\nend\n",
      0.1);
  CHECK(robot.server.host == "10.0.0.9");
  CHECK(robot.server.port == 8080);
  CHECK_THAT(robot.server.sent, StartsWith("POST /RPC2 HTTP/1.1\r\n") && Contains("Host: 10.0.0.9:8080\r\n") &&
                                    Contains("Content-Type: text/xml\r\n"));
  const std::size_t body = robot.server.sent.find("\r\n\r\n") + 4;
  CHECK_THAT(robot.server.sent,
             Contains("Content-Length: " + std::to_string(robot.server.sent.size() - body) + "\r\n"));
  CHECK_THAT(
      robot.server.sent,
      Contains("<methodName>find</methodName>") && Contains("<value><string>a&lt;b</string></value>") &&
          Contains("<value><i4>3</i4></value>") && Contains("<value><double>2.500000000000</double></value>") &&
          Contains("<value><boolean>1</boolean></value>") &&
          Contains(
              "<array><data><value><i4>1</i4></value><value><double>2.000000000000</double></value></data></array>") &&
          Contains("<struct><member><name>x</name><value><double>1.000000000000</double></value></member>") &&
          Contains("<member><name>rz</name><value><double>0.500000000000</double></value></member></struct>"));
  CHECK(robot.texts.empty());
  std::string pose;
  for (const char* name : {"rz", "ry", "rx", "z", "y", "x"}) {
    pose += std::string("<member>\n<name>") + name + "</name>\n<value><double>0.25</double></value>\n</member>\n";
  }
  const std::string answer = http(answer_of("<value><struct>\n" + pose + "</struct></value>"));
  for (const char byte : answer) {
    robot.server.to_robot += byte;
    robot.run(0.002);
  }
  robot.listen(0.05);
  CHECK(robot.texts == std::vector<std::string>{"p[0.25, 0.25, 0.25, 0.25, 0.25, 0.25]"});
  CHECK_THAT(robot.server.sent, Contains("<methodName>more</methodName>"));
  robot.server.to_robot = http(answer_of("<value><boolean>0</boolean></value>"));
  robot.listen(0.05);
  CHECK(robot.texts.size() == 3);
  CHECK(robot.texts.back() == "over");
  CHECK(robot.exceptions.empty());
  CHECK_FALSE(robot.server.open_now);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
}

TEST_CASE("a server that is not there, or does not know the function, ends the program", "[ur][script]") {
  RpcRobot robot;
  robot.server.reachable = false;
  robot.send("rpc = rpc_factory(\"xmlrpc\", \"http://10.0.0.9/\")\n", 0.1);
  REQUIRE(robot.exceptions.size() == 1);
  CHECK_THAT(robot.exceptions[0].text, Contains("nobody answers"));
  robot.server.reachable = true;
  const std::string call =
      "def prog():\n  rpc = rpc_factory(\"xmlrpc\", \"http://10.0.0.9/\")\n  textmsg(rpc.f())\nend\n";
  robot.send(call, 0.1);
  robot.server.to_robot = http(
      "<?xml version='1.0'?><methodResponse><fault><value><struct><member><name>faultCode</name><value><int>1</int>"
      "</value></member><member><name>faultString</name><value><string>no f here</string></value></member></struct>"
      "</value></fault></methodResponse>");
  robot.listen(0.1);
  REQUIRE(robot.exceptions.size() == 2);
  CHECK_THAT(robot.exceptions[1].text, Contains("no f here"));
  robot.send(call, 0.1);
  robot.server.to_robot = "HTTP/1.1 404 Not Found\r\n\r\n";
  robot.listen(0.1);
  REQUIRE(robot.exceptions.size() == 3);
  CHECK_THAT(robot.exceptions[2].text, Contains("404"));
  robot.send(call, 0.1);
  robot.server.open_now = false;
  robot.listen(0.1);
  REQUIRE(robot.exceptions.size() == 4);
  CHECK_THAT(robot.exceptions[3].text, Contains("ended"));
  robot.send("rpc = rpc_factory(\"pstream\", \"10.0.0.9:1\")\n", 0.1);
  robot.send("rpc = rpc_factory(\"xmlrpc\", \"10.0.0.9:1\")\n", 0.1);
  robot.send("def prog():\n  x = 1\n  x.f()\nend\n", 0.1);
  CHECK(robot.exceptions.size() == 7);
  CHECK(robot.texts.empty());
  CHECK_FALSE(script::compile("x.f(\n"));
  CHECK_FALSE(script::compile("def p():\n  x = 1\n  x.5()\nend\n"));
}

TEST_CASE("structs of a server, and methods of it that lists have, too", "[ur][script]") {
  RpcRobot robot;
  robot.send(
      "def prog():\n  rpc = rpc_factory(\"xmlrpc\", \"http://10.0.0.9/\")\n"
      "  found = rpc.append(struct(a = 1, b = \"x<\"))\n  found.count = found.count + 1\n  textmsg(found)\n"
      "  textmsg(rpc.pop())\nend\n",
      0.1);
  CHECK_THAT(robot.server.sent, Contains("<methodName>append</methodName>") &&
                                    Contains("<struct><member><name>a</name><value><i4>1</i4></value></member><member>"
                                             "<name>b</name><value><string>x&lt;</string></value></member></struct>"));
  robot.server.to_robot =
      http(answer_of("<value><struct><member><name>count</name><value><int>4</int></value></member></struct></value>"));
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"struct(count = 5)"});
  CHECK_THAT(robot.server.sent, Contains("<methodName>pop</methodName>"));
  robot.server.to_robot = http(answer_of("<value><int>6</int></value>"));
  robot.listen(0.1);
  CHECK(robot.texts.back() == "6");
  CHECK(robot.exceptions.empty());
}

TEST_CASE("a call goes to the server that was there when it began", "[ur][script]") {
  RpcRobot robot;
  robot.send(
      "def prog():\n  global rpc = rpc_factory(\"xmlrpc\", \"http://10.0.0.9/\")\n  thread t():\n    sleep(0.05)\n"
      "    rpc = make_list(0, 0, 5)\n  end\n  handle = run t()\n  textmsg(rpc.append(1))\n  textmsg(rpc)\nend\n",
      0.2);
  robot.server.to_robot = http(answer_of("<value><int>6</int></value>"));
  robot.listen(0.1);
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"6", "[]"});
  CHECK_FALSE(robot.server.open_now);
}

TEST_CASE("a program that is stopped within a call hangs up", "[ur][script]") {
  RpcRobot robot;
  robot.send("def prog():\n  rpc = rpc_factory(\"xmlrpc\", \"http://10.0.0.9/\")\n  rpc.f()\nend\n", 0.1);
  REQUIRE(robot.server.open_now);
  CHECK(robot.dashboard("stop") == "Stopped");
  robot.run(0.1);
  CHECK_FALSE(robot.server.open_now);
}

TEST_CASE("answers of XML-RPC as values", "[ur][script]") {
  CHECK(script::text_of(read("<value><int>-5</int></value>")) == "-5");
  CHECK(script::text_of(read("<value><i8>99999999999</i8></value>")) == "99999999999");
  CHECK(script::text_of(read("<value><i4>+7</i4></value>")) == "7");
  CHECK(script::text_of(read("<value><double>-0.25</double></value>")) == "-0.25");
  CHECK(script::text_of(read("<value><boolean>1</boolean></value>")) == "True");
  CHECK(script::text_of(read("<value><string>a &lt;&amp;lt; &#65;</string></value>")) == "a <&lt; A");
  CHECK(script::text_of(read("<value> bare </value>")) == " bare ");
  CHECK(script::text_of(read("<value><string></string></value>")).empty());
  CHECK(read("<value><nil/></value>").empty());
  CHECK(script::text_of(read("<value><array><data>\n<value><int>1</int></value>\n<value><array><data/></array></value>"
                             "<!-- a note --></data></array></value>")) == "[1, []]");
  CHECK(script::text_of(read("<value><struct><member><name>b</name><value>1</value></member><member><name>a</name>"
                             "<value><array><data><value><int>2</int></value></data></array></value></member></struct>"
                             "</value>")) == "struct(b = 1, a = [2])");
  CHECK(read("<value><struct></struct></value>").as<script::StructValue>()->names.empty());
  CHECK(script::read_xml_rpc_answer("<methodResponse><params></params></methodResponse>")->empty());
  for (const char* wrong :
       {"", "<value>", "<value><int>x</int></value>", "<value><int>1</double></value>",
        "<value><int>12abc</int></value>", "<value><i4>99999999999</i4></value>", "<value><double>nan</double></value>",
        "<value><double>inf</double></value>", "<value><date>1</date></value>",
        "<value><struct><member><name>a</name></member></struct></value>", "<value><array></value>"}) {
    INFO(wrong);
    CHECK_FALSE(script::read_xml_rpc_answer(answer_of(wrong)));
  }
  std::string opening, closing;
  for (int i = 0; i < 1000; ++i) {
    opening += "<value><array><data>";
    closing += "</data></array></value>";
  }
  CHECK_FALSE(script::read_xml_rpc_answer(answer_of(opening + "<value>1</value>" + closing)));
  CHECK_FALSE(script::xml_rpc_call("f", std::vector<Value>{Value(script::ThreadHandle{1})}));
}

TEST_CASE("HTTP addresses and answers", "[ur][script]") {
  CHECK(script::read_http_url("http://pc/RPC2")->port == 80);
  CHECK(script::read_http_url("http://pc:8080")->path == "/");
  for (const char* wrong :
       {"", "pc:80", "http://", "http://:80/", "http://pc:0/", "http://pc:99999/", "http://pc:x/"}) {
    CHECK_FALSE(script::read_http_url(wrong));
  }
  using script::read_http_answer;
  const std::string chunked =
      "HTTP/1.1 200 OK\r\ntransfer-encoding: Chunked\r\n\r\n3\r\nabc\r\nA\r\n0123456789\r\n0\r\n\r\n";
  CHECK(read_http_answer(chunked, false)->value() == "abc0123456789");
  CHECK_FALSE(read_http_answer(chunked.substr(0, chunked.size() - 8), false)->has_value());
  CHECK_FALSE(read_http_answer(chunked.substr(0, chunked.size() - 8), true));
  CHECK_FALSE(read_http_answer("HTTP/1.0 200 OK\r\n\r\nall of", false)->has_value());
  CHECK(read_http_answer("HTTP/1.0 200 OK\r\n\r\nall of it", true)->value() == "all of it");
  CHECK(read_http_answer("HTTP/1.1 100 Continue\r\n\r\n" + http("x"), false)->value() == "x");
  std::string patient;
  for (int i = 0; i < 50'000; ++i) patient += "HTTP/1.1 100 \r\n\r\n";
  CHECK(read_http_answer(patient + http("x"), false)->value() == "x");
  CHECK_FALSE(read_http_answer("", true));
  CHECK_FALSE(read_http_answer("no HTTP\r\n\r\n", false));
  const std::string whole = http("short");
  CHECK(read_http_answer(whole, true)->value() == "short");
  CHECK_FALSE(read_http_answer(whole.substr(0, whole.size() - 1), true));
  CHECK_FALSE(read_http_answer(std::string(2'000'000, 'x'), false));
}

}  // namespace firstlook
