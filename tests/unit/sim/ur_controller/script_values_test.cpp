/// Values of URScript and what can be made of them.
#include <catch2/catch.hpp>
#include <chrono>

#include "hal/sim/ur_controller/script/compiler.hpp"
#include "hal/sim/ur_controller/script/list_methods.hpp"
#include "tests/support/script_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using script::Value;

namespace {

/// What the lines say; what ends them last.
std::vector<std::string> said(ScriptRobot& robot, const std::string& lines, double run_s = 0.1) {
  robot.texts.clear();
  robot.exceptions.clear();
  robot.send("def prog():\n" + lines + "end\n", run_s);
  std::vector<std::string> texts = robot.texts;
  for (const auto& exception : robot.exceptions) texts.push_back("! " + exception.text);
  if (texts.empty()) texts.emplace_back("nothing");
  return texts;
}
using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("expressions", "[ur][script]") {
  ScriptRobot robot;
  CHECK(robot.value("1 + 2 * 3 - 4") == "3");
  CHECK(robot.value("(1 + 2) * 3") == "9");
  CHECK(robot.value("7 / 2") == "3.5");
  CHECK(robot.value("7 % 3") == "1");
  CHECK(robot.value("-2 + 1.5") == "-0.5");
  CHECK(robot.value("1e-3 * 2") == "0.002");
  CHECK(robot.value("2147483647 + 1") == "-2147483648");
  CHECK(robot.value("1 < 2 and not 2 <= 1") == "True");
  CHECK(robot.value("False or 1 == 1.0") == "True");
  CHECK(robot.value("True xor True") == "False");
  CHECK(robot.value("False and 1/0 == 1") == "False");  // not evaluated
  CHECK(robot.value("[1, 2.5, [True]]") == "[1, 2.5, [True]]");
  CHECK(robot.value("[10, 20, 30][1]") == "20");
  CHECK(robot.value("p[1,2,3,0,0,0.5]") == "p[1, 2, 3, 0, 0, 0.5]");
  CHECK(robot.value("p[1,2,3,0,0,0.5][2]") == "3");
  CHECK(robot.value("[1,2] == [1,2]") == "True");
  CHECK(robot.value("\"a b\" != \"a\"") == "True");
  CHECK(robot.value("str_cat(\"x\", 5)") == "x5");
  CHECK(robot.value("sqrt(16) + floor(2.7) + pow(2, 3)") == "14");
  CHECK(robot.value("r2d(atan2(1, 1))") == "45");
  CHECK(robot.value("norm([3, 4])") == "5");
  CHECK(robot.value("length([1,2,3])") == "3");
  CHECK(robot.value("to_num(\"2.5\")") == "2.5");
  CHECK(robot.value("str_find(\"hello\", \"l\")") == "2");
  CHECK(robot.value("binary_list_to_integer([True, False, True])") == "5");
  CHECK(robot.value("integer_to_binary_list(2)[1]") == "True");
  CHECK_THAT(robot.value("1 / 0"), Contains("Division by zero"));
  CHECK_THAT(robot.value("[1][1]"), Contains("out of bounds"));
  CHECK_THAT(robot.value("\"a\" + 1"), Contains("Type error"));
  CHECK_THAT(robot.value("sqrt(-1)"), StartsWith("!"));
  CHECK_THAT(robot.value("textmsg(1)"), StartsWith("!"));  // has no value
}

TEST_CASE("vectors, matrices and wrenches", "[ur][script]") {
  ScriptRobot robot;
  CHECK(robot.value("norm(p[3, 4, 0, 0, 0, 0])") == "5");
  CHECK(robot.value("normalize([0, 3, 4])") == "[0, 0.6, 0.8]");
  CHECK(robot.value("size([[1, 2, 3], [4, 5, 6]])") == "[2, 3]");
  CHECK(robot.value("transpose([[1, 2, 3], [4, 5, 6]])") == "[[1, 4], [2, 5], [3, 6]]");
  CHECK(robot.value("[[1, 2], [3, 4], [5, 6]] * [[10, 20, 30], [40, 50, 60]]") ==
        "[[90, 120, 150], [190, 260, 330], [290, 400, 510]]");
  CHECK(robot.value("[[1, 2], [3, 4], [5, 6]] * [10, 20]") == "[50, 110, 170]");
  CHECK(robot.value("[[1, 2], [3, 4]] + [[10, 20], [30, 40]]") == "[[11, 22], [33, 44]]");
  CHECK(robot.value("5 * [[1, 2], [3, 4]]") == "[[5, 10], [15, 20]]");
  CHECK(robot.value("10 / [10, 20, 40]") == "[1, 0.5, 0.25]");
  CHECK(robot.value("[10, 20, 31] % [4, 5, 6]") == "[2, 0, 1]");
  CHECK(robot.value("[1, 2, 3] * [10, 20, 30]") == "[10, 40, 90]");
  CHECK(robot.value("[[1, 2], [3, 4], [5, 6]][2, 1]") == "6");
  CHECK(robot.value("inv([[2, 0], [0, 4]])") == "[[0.5, 0], [0, 0.25]]");
  // Least squares: the line through (0, 1), (1, 3), (2, 5).
  const std::string a = "[[1, 0], [1, 1], [1, 2]]", at = "transpose(" + a + ")";
  CHECK(robot.value("norm(inv(" + at + " * " + a + ") * " + at + " * [1, 3, 5] - [1, 2]) < 1e-9") == "True");
  CHECK_THAT(robot.value("[[1, 2], [3, 4]] * [[1, 2]]"), Contains("do not fit"));
  CHECK_THAT(robot.value("[10, 20] * [[1, 2], [3, 4]]"), Contains("a product is of two matrices"));
  CHECK_THAT(robot.value("inv([[1, 2], [2, 4]])"), Contains("no inverse"));
  CHECK_THAT(robot.value("inv([[1, 2, 3], [2, 4, 5]])"), Contains("square"));
  CHECK_THAT(robot.value("inv([[1, 2], [3]])"), Contains("square"));
  CHECK_THAT(robot.value("inv([[0, 0], [3, 1]])"), Contains("no inverse"));
  CHECK(robot.value("inv([[0.000001, 0], [0, 1000000000000.0]])[0, 0]") == "1e+06");
  CHECK(robot.value("transpose([[True, False]])") == "[[True], [False]]");
  CHECK(robot.value("size([[\"a\", \"b\"]])") == "[1, 2]");
  CHECK(robot.value("[[2147483647, 1]] * [[1], [1]]") == "[[-2147483648]]");
  CHECK(robot.value("[[2147483647, 2147483647, 2147483647]] * [2147483647, 2147483647, 2147483647]") == "[3]");
  CHECK_THAT(robot.value("make_list(100, make_list(100, 1)) * make_list(100, make_list(100, 1))"),
             Contains("too large"));
  CHECK_THAT(robot.value("[[1, 2], [3]] * [[1], [2]]"), Contains("a product is of two matrices"));
  CHECK_THAT(robot.value("transpose([1, 2])"), Contains("a matrix"));
  CHECK(robot.value("inv(p[1, 2, 3, 0, 0, 0])") == robot.value("pose_inv(p[1, 2, 3, 0, 0, 0])"));
  // 10 N along y, seen from 0.5 m further along x: a torque about z.
  CHECK(robot.value("wrench_trans(p[0.5, 0, 0, 0, 0, 0], [0, 10, 0, 0, 0, 0])") == "[0, 10, 0, 0, 0, -5]");
  CHECK(robot.value("get_target_payload_inertia()") == "[0, 0, 0, 0, 0, 0]");
}

TEST_CASE("poses", "[ur][script]") {
  ScriptRobot robot;
  CHECK(robot.value("pose_trans(p[1,0,0,0,0,1.5707963267948966], p[1,0,0,0,0,0])") == "p[1, 1, 0, 0, 0, 1.5708]");
  CHECK(robot.value(
            "point_dist(pose_trans(pose_inv(p[1,2,3,0.1,0.2,0.3]), p[1,2,3,0.1,0.2,0.3]), p[0,0,0,0,0,0]) < 1e-9") ==
        "True");
  CHECK(robot.value("pose_add(p[1,0,0,0,0,0], p[0,1,0,0,0,0])") == "p[1, 1, 0, 0, 0, 0]");
  CHECK(robot.value("interpolate_pose(p[0,0,0,0,0,0], p[1,0,0,0,0,1], 0.5)") == "p[0.5, 0, 0, 0, 0, 0.5]");
  CHECK(robot.value("rpy2rotvec([0.3, 0, 0])") == "[0.3, 0, 0]");
  CHECK(robot.value("point_dist(get_forward_kin(), get_actual_tcp_pose()) < 1e-9") == "True");
  CHECK(robot.value("norm(get_inverse_kin(get_actual_tcp_pose()) - get_actual_joint_positions()) < 1e-6") == "True");
  CHECK(robot.value("get_inverse_kin_has_solution(p[5,0,0,0,0,0])") == "False");
}

TEST_CASE("elements of lists in lists", "[ur][script]") {
  ScriptRobot robot;
  CHECK(said(robot, R"(
  m = [[1, 2], [3, 4], [5, 6]]
  m[2, 1] = 20
  m[0][0] = m[1, 0] + m[2][1]
  textmsg(m)
  p = [[7, 8], [9, 10]]
  textmsg(p[1, 0])
  textmsg(p[0])
  textmsg(m[3, 0])
)") == Texts{"[[23, 2], [3, 4], [5, 20]]", "9", "[7, 8]", "! Index out of bounds: 3 of 3"});
  CHECK(said(robot, "  x = p[1,2,3,0,0,0]\n  x[2] = 9\n  textmsg(x)\n  x[0, 0] = 1\n") ==
        Texts{"p[1, 2, 9, 0, 0, 0]", "! Type error: float has no elements"});
  CHECK_FALSE(script::compile("x = [1]\ny = x[]\n"));
  CHECK_FALSE(script::compile("x = [1]\nx[] = 2\n"));
}

TEST_CASE("structs: members by name and by number, nested, given to functions and changed", "[ur][script]") {
  ScriptRobot robot;
  CHECK(said(robot, R"(
  my = struct(identifier1 = 1, identifier2 = 2, myMember = "Hello structs", listMember = [1, 2, 3])
  my.myMember = "Goodbye structs"
  textmsg(my.myMember)
  textmsg(my.listMember[0])
  textmsg(my[1])
  my.listMember[2] = 30
  my.listMember = [7, 8]
  my.identifier2 = 2.5
  textmsg(my)
  outer = struct(inner = struct(deep = [[1, 2], [3, 4]], on = False), name = "n")
  outer.inner.deep[1, 0] = 9
  outer.inner.on = True
  copy = outer.inner
  copy.on = False
  textmsg(outer)
  def extended(arg):
    local all = struct(m1 = 0.0, m2 = "n/a", extra = False)
    all.m1 = arg.inner.deep[0, 1]
    all.m2 = arg.name
    all.extra = True
    return all
  end
  made = extended(outer)
  textmsg(made.m1 + 1)
  textmsg(made == struct(m1 = 2, m2 = "n", extra = True))
  textmsg(made == struct(m1 = 2, m2 = "n", other = True))
  numbers = [0.0, 0.0, 0.0]
  numbers = struct(a = 1.5, b = 2.5, c = 3.5)
  textmsg(numbers)
)") == Texts{"Goodbye structs", "1", "2",
             "struct(identifier1 = 1, identifier2 = 2.5, myMember = Goodbye structs, listMember = [7, 8])",
             "struct(inner = struct(deep = [[1, 2], [9, 4]], on = True), name = n)", "3", "True", "False",
             "[1.5, 2.5, 3.5]"});
  CHECK_THAT(said(robot, "  s = struct(a = 1)\n  s.a = \"one\"\n").back(), Contains("member a is int, not string"));
  CHECK_THAT(said(robot, "  s = struct(a = 1)\n  s.b = 1\n").back(), Contains("no member b"));
  CHECK_THAT(said(robot, "  s = struct(a = 1)\n  textmsg(s.b)\n").back(), Contains("no member b"));
  CHECK_THAT(said(robot, "  s = struct(a = 1)\n  textmsg(s[1])\n").back(), Contains("out of bounds"));
  CHECK_THAT(said(robot, "  s = [1]\n  textmsg(s.a)\n").back(), Contains("list has no members"));
  CHECK_THAT(said(robot, "  s = 1\n  s.a = 2\n").back(), Contains("has no members"));
  CHECK_THAT(said(robot, "  s = struct(i = struct(a = 1))\n  s.i = struct(b = 1)\n").back(), Contains("other members"));
  CHECK(said(robot, "  s = struct(a = [1, 2])\n  s.a = struct(x = 3, y = 4)\n  textmsg(s)\n").back() ==
        "struct(a = [3, 4])");
  CHECK(said(robot,
             "  thread th():\n    sync()\n  end\n  s = struct(t = 0)\n  s.t = run th()\n  join s.t\n  s.t = 0\n  "
             "textmsg(s)\n")
            .back() == "struct(t = 0)");
  CHECK(said(robot, "  x = []\n  x = struct(a = 1)\n  textmsg(x.a)\n").back() == "1");
  CHECK_THAT(said(robot, "  x = [1]\n  x[0] = textmsg(\"hi\")\n").back(), Contains("without a value"));
  CHECK_THAT(said(robot, "  x = [textmsg(\"hi\")]\n").back(), Contains("without a value"));
  CHECK_THAT(said(robot, "  global x\n  x[0] = 1\n").back(), Contains("x has no value yet"));
  CHECK_THAT(said(robot, "  global x\n  x.append(1)\n").back(), Contains("x has no value yet"));
  CHECK_THAT(said(robot, "  s = struct(a = 1, a = 2)\n").back(), Contains("two members"));
  CHECK_THAT(said(robot, "  s = struct(a = 1)\n  s.a()\n").back(), Contains("method of struct"));
  for (const char* wrong :
       {"s = struct()\n", "s = struct(1)\n", "s = struct(a = )\n", "s = struct(a = 1 b = 2)\n",
        "s = struct(a = 1)\ns. = 2\n", "s = struct(a = 1)\ns.5 = 2\n", "unknown.a = 1\n", "unknown[0] = 1\n"}) {
    INFO(wrong);
    CHECK_FALSE(script::compile(wrong));
  }
}

TEST_CASE("lists grow up to their capacity and shrink", "[ur][script]") {
  ScriptRobot robot;
  CHECK(said(robot, R"(
  aa = make_list(length = 2, initial_value = 11, capacity = 5)
  textmsg(aa.length() + 10 * aa.capacity() + 100 * aa.excess_capacity())
  aa.append(88)
  aa.insert(1, 22)
  textmsg(aa)
  last = aa.pop()
  textmsg(last + aa.remove(0))
  aa.extend([5, 6])
  textmsg(aa.to_string())
  textmsg(aa.slice(1, 3))
  aa = [1, 2]
  textmsg(aa.capacity())
  bb = [1, 2, 3]
  bb = aa
  textmsg(bb.capacity())
  aa.clear()
  textmsg(aa.length())
  nested = struct(list = make_list(0, 0, 2), other = [[1], make_list(1, 2, 3)])
  nested.list.append(4)
  nested.other[1].append(5)
  nested.other[1].append(6)
  textmsg(nested)
  def grown(list):
    list.append(3)
    return list
  end
  cc = make_list(1, 2, 4)
  textmsg(grown(cc))
  textmsg(cc)
  textmsg(length(cc) + get_list_length(cc))
  cc[0] = 7
  cc.append(8)
  textmsg(cc)
  nested.list.append(5)
  nested.list.append(6)
)") == Texts{"352", "[11, 22, 11, 88]", "99", "[22, 11, 5, 6]", "[11, 5]", "5", "3", "0",
             "struct(list = [4], other = [[1], [2, 5, 6]])", "[2, 3]", "[2]", "2", "[7, 8]",
             "! The list has a capacity of 2 elements"});
  CHECK_THAT(said(robot, "  a = [1]\n  a.append(2)\n").back(), Contains("capacity of 1"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  a.append(\"x\")\n").back(), Contains("Type error"));
  CHECK_THAT(said(robot, "  a = make_list(0, 2, 4)\n  a.pop()\n").back(), Contains("empty"));
  CHECK_THAT(said(robot, "  a = make_list(0, 2, 4)\n  a.append(a.clear())\n").back(), Contains("without a value"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  a.insert(2, 0)\n").back(), Contains("out of bounds"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  a.insert(0)\n").back(), Contains("takes 2 arguments"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  a.sort()\n").back(), Contains("no method sort"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  b = a.append(2)\n").back(), Contains("without a value"));
  CHECK_THAT(said(robot, "  a = make_list(5, 2, 4)\n").back(), Contains("capacity"));
  CHECK_THAT(said(robot, "  a = make_list(3, 2, 4)\n  textmsg(a.slice(2, 1))\n").back(), Contains("slice"));
  CHECK_THAT(said(robot, "  a = make_list(1, 2, 4)\n  a.append(a[7])\n").back(), Contains("out of bounds"));
}

TEST_CASE("what changes an element or a list does so at once, when all that it needs is there", "[ur][script]") {
  ScriptRobot robot;
  CHECK(said(robot, R"(
  a = make_list(0, 0, 10)
  def f():
    a.append(1)
    return 2
  end
  a.append(f())
  textmsg(a)
  a.insert(0, a.pop())
  textmsg(a)
  state = struct(n = 0, x = 0)
  def next():
    state.n = state.n + 1
    return state.n
  end
  state.x = next()
  textmsg(state)
  b = [5, 6, 7]
  b[0] = b.pop()
  textmsg(b)
)") == Texts{"[1, 2]", "[2, 1]", "struct(n = 1, x = 1)", "[7, 6]"});
  CHECK(said(robot, R"(
  global queue = make_list(0, 0, 1000)
  global both = struct(a = 0, b = 0)
  def slow(value):
    sleep(0.01)
    return value
  end
  thread one():
    i = 0
    while i < 5:
      queue.append(slow(1))
      both.a = slow(i)
      i = i + 1
    end
  end
  thread two():
    i = 0
    while i < 300:
      queue.append(2)
      both.b = i
      i = i + 1
    end
  end
  first = run one()
  second = run two()
  join first
  join second
  textmsg(queue.length())
  textmsg(both)
)",
             0.5) == Texts{"305", "struct(a = 4, b = 299)"});
}

TEST_CASE("the words of the language are no members", "[ur][script]") {
  for (const char* wrong :
       {"s = struct(end = 1)\n", "s = struct(a = 1)\nx = s.end\n", "s = struct(a = 1)\ns.global = 6\n"}) {
    INFO(wrong);
    CHECK_FALSE(script::compile(wrong));
  }
  CHECK(script::compile("s = struct(p = 1, length = 2, append = 3,)\nx = s.append + s.p\ns.length = 3\n"));
}

TEST_CASE("values are bounded, with their names and in depth", "[ur][script]") {
  ScriptRobot robot;
  const std::string name(300'000, 'n');
  CHECK_THAT(said(robot, "  s = struct(" + name + " = 1)\n  m = make_list(1000, s)\n").back(), Contains("too large"));
  const std::string shorter(60'000, 'n');
  // What is emptied takes no memory, and what was deep is not so for ever.
  Value list = script::with_capacity(script::List(5000, Value(std::int64_t{1})), 10'000);
  REQUIRE(script::call_list_method(list, "clear", {}));
  CHECK(list.as<script::List>()->capacity() == 0);
  list = Value(script::List(5000, Value(std::int64_t{1})));
  while (list.as<script::List>()->size() > 1) REQUIRE(script::call_list_method(list, "pop", {}));
  CHECK(list.as<script::List>()->capacity() < 100);
  CHECK(list.weight == 2);
  CHECK(said(robot,
             "  a = make_list(1, 0, 5)\n  i = 0\n  while i < 200:\n    a[0] = a\n    a[0] = 1\n    i = i + 1\n  end\n  "
             "textmsg(a)\n")
            .back() == "[1]");
  // The weight of what lies within counts.
  CHECK_THAT(said(robot,
                  "  s = struct(l = make_list(0, 0, 20000))\n  one = make_list(1000, 0)\n  while True:\n"
                  "    s.l.extend(one)\n  end\n")
                 .back(),
             Contains("a list is too large"));
  const Texts printed = said(robot, "  s = struct(" + shorter + " = 1)\n  textmsg([s, s, s, s, s, s])\n");
  REQUIRE(printed.size() == 1);
  CHECK(printed[0].size() < 200'000);
  CHECK_THAT(said(robot, "  a = [1]\n  while True:\n    a = [a]\n  end\n").back(), Contains("nested too deep"));
  CHECK_THAT(said(robot, "  a = [[1], [1]]\n  while True:\n    a[0] = a\n  end\n").back(), Contains("nested too deep"));
  CHECK_THAT(said(robot,
                  "  a = make_list(0, 0, 20000)\n  one = make_list(1000, 0)\n  i = 0\n  while i < 19:\n"
                  "    a.extend(one)\n    i = i + 1\n  end\n  i = 0\n  while i < 999:\n    a.append(1)\n"
                  "    i = i + 1\n  end\n  textmsg(a.length())\n  a.append(1)\n")
                 .back(),
             Contains("too large"));
  CHECK(robot.texts.back() == "19999");
}

TEST_CASE("heavy lists and matrices do not hold up the controller", "[ur][script]") {
  const std::string big =
      "  z = make_list(0, 0, 20000)\n  one = make_list(1000, 0)\n  i = 0\n  while i < 9:\n    z.extend(one)\n"
      "    i = i + 1\n  end\n  m = [z]\n  r = make_list(58, 1.5)\n  k = make_list(58, r)\n  q = make_list(50, "
      "make_list(50, 0))\n"
      "  i = 0\n  while i < 50:\n    q[i, i] = 1\n    i = i + 1\n  end\n  while True:\n";
  for (const char* line : {"y = transpose(m)", "y = k * k", "y = inv(q)", "z.insert(0, 1) z.remove(0)",
                           "z.append(1) z.pop()", "y = z.length()", "z[0] = 1", "y = z.slice(0, 9000)"}) {
    INFO(line);
    ScriptRobot robot;
    const auto begin = std::chrono::steady_clock::now();
    const Texts end = said(robot, big + "    " + line + "\n  end\n", 3);
    CHECK_THAT(end.back(), Contains("too much behind"));
    // A thousand cycles of a program that never waits: a second or so, under sanitizers 30.
    CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(120));
  }
}

TEST_CASE("a list that another thread changes is the program's", "[ur][script]") {
  ScriptRobot robot;
  CHECK(said(robot, R"(
  global queue = make_list(0, 0, 100)
  thread fill():
    i = 0
    while i < 5:
      queue.append(i)
      i = i + 1
      sync()
    end
  end
  handle = run fill()
  join handle
  textmsg(queue)
)") == Texts{"[0, 1, 2, 3, 4]"});
}

}  // namespace firstlook
