#include "spartan/core/strict_yaml.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace spartan {
namespace {

using ::testing::HasSubstr;

YamlNode parse_node(const std::string& text) {
  return parse_yaml(text, "a.yaml").value();
}
std::string parse_error(const std::string& text) {
  const auto root = parse_yaml(text, "a.yaml");
  if (root) return "nothing";
  EXPECT_EQ(root.error().code, ErrorCode::configuration);
  return root.error().message();
}

// The errors of `read` applied to the root map of a text.
template <class Read>
std::string errors_of(const std::string& text, const Read& read) {
  YamlErrors errors("a.yaml");
  YamlMap map(parse_node(text), "", errors);
  read(map);
  map.reject_unknown_keys();
  const Status status = errors.status();
  return status ? "" : status.error().message();
}

TEST(ParseYaml, BuildsATreeWithLines) {
  const YamlNode root = parse_node("# comment\nname: 'a b'\nlist:\n  - 1\n  - [x, ~]\nempty:\n");
  ASSERT_TRUE(root.is_map());
  ASSERT_EQ(root.entries().size(), 3U);
  EXPECT_EQ(root.entries()[0].key.scalar(), "name");
  EXPECT_EQ(root.entries()[0].value.scalar(), "a b");
  EXPECT_EQ(root.entries()[0].key.line(), 2);
  const YamlNode& list = root.entries()[1].value;
  ASSERT_TRUE(list.is_list());
  ASSERT_EQ(list.items().size(), 2U);
  EXPECT_EQ(list.items()[1].line(), 5);
  EXPECT_EQ(list.items()[1].items()[0].scalar(), "x");
  EXPECT_TRUE(list.items()[1].items()[1].is_null());
  EXPECT_TRUE(root.entries()[2].value.is_null());
  EXPECT_TRUE(parse_node("").is_null());
  EXPECT_TRUE(parse_node("---\n").is_null());
}

TEST(ParseYaml, InvalidTextIsReportedWithItsLine) {
  EXPECT_THAT(parse_error("a: 1\nb: [1\n"), HasSubstr(": not valid YAML: "));
  EXPECT_EQ(parse_error("a: 1\nb: \xC0\xAF\n"), "a.yaml:2: not valid UTF-8");
  std::string list = "a: [";
  for (int i = 0; i < 100001; ++i) list += "1,";
  EXPECT_EQ(parse_error(list + "1]"), "a.yaml: holds more than 100000 values");
}

TEST(ParseYaml, AnUnfinishedQuoteIsAnError) {
  for (const char* text : {"name: 'x\n", "name: 'x", "name: \"x\n\n", "a: 1\nlist: ['x\n"})
    EXPECT_THAT(parse_error(text), HasSubstr("not valid YAML")) << text;
  EXPECT_EQ(parse_node("a: |\n  text\n").entries()[0].value.scalar(), "text\n") << "the end of the text stays as it is";
  EXPECT_EQ(parse_node("a: |\n  text").entries()[0].value.scalar(), "text\n");
}

TEST(ParseYaml, ThereIsOneDocument) {
  EXPECT_THAT(parse_error("a: 1\n---\nb: 2\n"), HasSubstr("a.yaml: holds more than one document"));
  for (const char* text : {"---\na: 1\n", "a: 1\n...\n", "a: 1\n---\n", "---\na: 1\n...\n"})
    EXPECT_EQ(parse_node(text).entries().size(), 1U) << text;
  EXPECT_TRUE(parse_node("").is_null());
}

TEST(ParseYaml, AliasesShareTheirAnchor) {
  const YamlNode root = parse_node("a: &x [1, 2]\nb: *x\n");
  EXPECT_EQ(root.entries()[1].value.items().at(1).scalar(), "2");
  EXPECT_THAT(parse_error("a: &x [1, *x]\n"), HasSubstr("a.yaml:1: not valid YAML: "));
  EXPECT_THAT(parse_error("a: *none\n"), HasSubstr("a.yaml:1: not valid YAML: "));
  // Aliases of aliases: each level doubles the number of values that a full expansion would have.
  std::string doubling = "a0: &a0 [1, 1]\n";
  for (int i = 1; i < 60; ++i) doubling += fmt::format("a{0}: &a{0} [*a{1}, *a{1}]\n", i, i - 1);
  EXPECT_EQ(parse_node(doubling).entries().size(), 60U);
  std::string nested = "a0: &a0 [1]\n";
  for (int i = 1; i < 5000; ++i) nested += fmt::format("a{0}: &a{0} [*a{1}]\n", i, i - 1);
  EXPECT_THAT(parse_error(nested), HasSubstr("nested too deeply"));
  EXPECT_THAT(parse_error(std::string(100000, '[')), HasSubstr("not valid YAML"));
}

TEST(YamlMap, GettersReturnValues) {
  YamlErrors errors("a.yaml");
  YamlMap map(parse_node("t: word\nb: False\nx: +1.5e1\ni: 3.0\nl: [1, -2]\nc: red\nn: {k: 7}\n"), "", errors);
  EXPECT_EQ(map.text("t"), "word");
  EXPECT_EQ(map.boolean("b"), false);
  EXPECT_EQ(map.number("x"), 15.0);
  EXPECT_EQ(map.integer("i"), 3);
  EXPECT_EQ(map.numbers("l"), (std::vector<double>{1, -2}));
  EXPECT_EQ(map.numbers("l", {2, 3}), (std::vector<double>{1, -2}));
  EXPECT_EQ(map.choice("c", {"red", "blue"}), "red");
  EXPECT_EQ(YamlMap(*map.node("n"), map.path("n"), errors).integer("k"), 7);
  EXPECT_TRUE(map.has("t"));
  EXPECT_FALSE(map.has("none"));
  EXPECT_FALSE(map.optional_node("none"));
  map.reject_unknown_keys();
  EXPECT_TRUE(errors.status());
}

TEST(YamlMap, EachErrorNamesFileLineAndKey) {
  const auto error_with = [](const std::string& text, auto getter) {
    return errors_of(text, [&](YamlMap& map) { EXPECT_FALSE(getter(map)); });
  };
  const auto text = [](YamlMap& m) { return m.text("k"); };
  const auto boolean = [](YamlMap& m) { return m.boolean("k"); };
  const auto number = [](YamlMap& m) { return m.number("k"); };
  const auto integer = [](YamlMap& m) { return m.integer("k"); };
  const auto pair = [](YamlMap& m) { return m.numbers("k", {2, 3}); };
  EXPECT_EQ(error_with("{}", number), "a.yaml:1: k: is missing");
  EXPECT_EQ(error_with("\nk: [a]\n", text), "a.yaml:2: k: must be text");
  EXPECT_EQ(error_with("k:\n", text), "a.yaml:1: k: must be text");
  EXPECT_EQ(error_with("k: yes\n", boolean), "a.yaml:1: k: must be true or false");
  EXPECT_EQ(error_with("k: wide\n", number), "a.yaml:1: k: 'wide' is not a number");
  EXPECT_EQ(error_with("k: 1e999\n", number), "a.yaml:1: k: '1e999' is not a number");
  EXPECT_EQ(error_with("k: -.Inf\n", number), "a.yaml:1: k: is -.Inf, must be a finite number");
  EXPECT_EQ(error_with("k: {}\n", number), "a.yaml:1: k: must be a number");
  EXPECT_EQ(error_with("k: two\n", integer), "a.yaml:1: k: 'two' is not a whole number");
  EXPECT_THAT(error_with("k: 1.5\n", integer), HasSubstr("a.yaml:1: k: is 1.5, must be a whole number between"));
  EXPECT_THAT(error_with("k: 3000000000\n", integer), HasSubstr("k: is 3000000000, must be a whole number between"));
  EXPECT_EQ(error_with("k: 3\n", pair), "a.yaml:1: k: must be a list of 2 or 3 numbers");
  EXPECT_EQ(error_with("k: [1]\n", pair), "a.yaml:1: k: has 1 entries, must be a list of 2 or 3 numbers");
  EXPECT_EQ(error_with("k: [1, x]\n", pair), "a.yaml:1: k: 'x' is not a number");
  EXPECT_EQ(error_with("k: [1, []]\n", pair), "a.yaml:1: k: must hold numbers only");
}

TEST(YamlMap, StructureOfMapsIsChecked) {
  const auto nothing = [](YamlMap&) {};
  EXPECT_EQ(errors_of("just text", nothing), "a.yaml:1: must be a group of `key: value` lines");
  EXPECT_EQ(errors_of("a: 1\nb: 2\n", [](YamlMap& m) { (void)m.has("a"); }), "a.yaml:2: b: unknown key; known keys: a");
  EXPECT_EQ(errors_of("a: 1\nb: 2\na: 3\n",
                      [](YamlMap& m) {
                        EXPECT_EQ(m.integer("a"), 1);
                        (void)m.has("b");
                      }),
            "a.yaml:1: a: is given twice, again in line 3");
  EXPECT_THAT(errors_of("? [a]\n: 1\n", nothing), HasSubstr("a.yaml:1: a key must be a scalar"));
}

TEST(YamlMap, FormerNamesAreRenamed) {
  YamlErrors errors("a.yaml");
  YamlMap map(parse_node("x: 1\nold: wide\nboth: 1\nformer: 2\n"), "", errors);
  EXPECT_TRUE(map.rename("old", "new"));
  EXPECT_FALSE(map.rename("absent", "x"));
  EXPECT_FALSE(map.rename("former", "both"));
  EXPECT_FALSE(map.number("new"));
  (void)map.has("x");
  (void)map.has("both");
  map.reject_unknown_keys();
  EXPECT_EQ(errors.status().error().message(),
            "a.yaml:2: new: 'wide' is not a number\n"
            "a.yaml:4: former: is the former name of both, which is given too");
}

TEST(YamlErrors, AreSortedByLineAndLimited) {
  YamlErrors errors("a.yaml");
  errors.set_line("b", 7);
  errors.set_line("b", 9);
  errors.set_line("a", 2);
  errors.add("b.inner.key", "second");
  errors.add("a", "first");
  errors.add("", "general");
  EXPECT_EQ(errors.status("a hint").error().message(),
            "a.yaml:1: general\na.yaml:2: a: first\na.yaml:7: b.inner.key: second (a hint)");
  EXPECT_TRUE(errors.has_error_near("b"));
  EXPECT_TRUE(errors.has_error_near("b.inner"));
  EXPECT_TRUE(errors.has_error_near("a.further"));
  EXPECT_FALSE(YamlErrors("a.yaml").has_error_near("a"));
  for (int i = 0; i < 100; ++i) errors.add("c", "more");
  EXPECT_THAT(errors.status().error().message(), HasSubstr("\na.yaml: and 53 more errors"));
}

TEST(YamlErrors, TextOfACommandLineHasNoLines) {
  YamlErrors errors("--set a=x", false);
  YamlMap map(YamlNode::map_of({{YamlNode::text("a"), parse_node("x")}}), "", errors);
  EXPECT_FALSE(map.number("a"));
  EXPECT_EQ(errors.status().error().message(), "--set a=x: a: 'x' is not a number");
}

TEST(ParseFiniteNumber, RequiresThatTheWholeTextIsANumber) {
  EXPECT_EQ(parse_finite_number("5."), 5.0);
  EXPECT_EQ(parse_finite_number(".5"), 0.5);
  EXPECT_EQ(parse_finite_number("+1e+3"), 1000.0);
  EXPECT_EQ(parse_finite_number("5e-324"), 5e-324);
  for (const char* bad : {"", "+", "+-1", "1x", " 1", "nan", "inf", "0x10", "1e999", "1,5"})
    EXPECT_FALSE(parse_finite_number(bad)) << bad;
}

RC_GTEST_PROP(YamlQuoted, RoundTrips, ()) {
  const auto text = *rc::gen::container<std::string>(rc::gen::inRange<char>(' ', 127));
  const YamlNode root = parse_node("a: " + yaml_quoted(text) + "\n");
  RC_ASSERT(root.entries().at(0).value.scalar() == text);
}

// Any text is either parsed or rejected.
RC_GTEST_PROP(ParseYaml, SurvivesAnyText, ()) {
  const auto text = *rc::gen::container<std::string>(rc::gen::elementOf(std::string("&a*-?:,[]{}#'\"| \n!%x1\t")));
  const auto root = parse_yaml(text, "a.yaml");
  if (!root) RC_ASSERT(root.error().code == ErrorCode::configuration);
}

TEST(ClosestName, IsAtMostAThirdOfTheLettersAway) {
  const std::vector<std::string> names{"width_px", "height_px", "run", "rig"};
  EXPECT_EQ(closest_name("widht_px", names), "width_px") << "neighbours exchanged";
  EXPECT_EQ(closest_name("heigth", {"height"}), "height");
  EXPECT_EQ(closest_name("runn", names), "run");
  EXPECT_EQ(closest_name("rum", names), "run");
  EXPECT_EQ(closest_name("fly", names), "");
  EXPECT_EQ(closest_name("b", {"a"}), "");
  EXPECT_EQ(closest_name("", names), "");
  EXPECT_EQ(closest_name("run", {}), "");
}

}  // namespace
}  // namespace spartan
