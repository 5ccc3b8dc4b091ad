#include "spartan/core/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct SpeckleOptions {
  int size_px = 100;
  double difference_px = 1.5;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("size_px", size_px, "Speckles of fewer pixels are removed.", at_least(0));
    v.field("difference_px", difference_px, "Largest difference of neighbours in a speckle, in px.", between(0, 10));
  }
};

struct MatcherOptions {
  bool enabled = true;
  std::string method = "sgm";
  std::string note;
  std::vector<double> lengths_m{1, 2.5};
  double gain = 0.1;
  SpeckleOptions speckle;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "Whether to match.");
    v.field("method", method, "Matching method.", {"sgm", "block"});
    v.field("note", note, "Free text.");
    v.field("lengths_m", lengths_m, "Lengths in m.", at_least(0));
    v.field("gain", gain, "Any finite number.");
    v.group("speckle", speckle);
  }
};

struct MaskOptions {
  std::string name;
  int rows = 1;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("name", name, "Name of the mask.");
    v.field("rows", rows, "Number of masked rows.", between(1, 9));
  }
};

struct RunOptions {
  MatcherOptions matcher;
  int threads = 1;
  template <class Visitor>
  void describe(Visitor& v) {
    v.group("matcher", matcher);
    v.field("threads", threads, "Number of threads.", between(1, 64));
  }
};

Result<RunOptions> parse(const std::string& text) {
  return parse_options<RunOptions>(text, "run.yaml");
}
std::string error_of(const std::string& text) {
  const auto result = parse(text);
  EXPECT_FALSE(result) << text;
  if (result) return {};
  EXPECT_EQ(result.error().code, ErrorCode::configuration);
  return result.error().message();
}

TEST(Options, MissingKeysKeepTheirDefaults) {
  const auto options = parse("matcher:\n  speckle:\n    size_px: 7\n");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->matcher.speckle.size_px, 7);
  EXPECT_EQ(options->matcher.speckle.difference_px, 1.5);
  EXPECT_EQ(options->matcher.method, "sgm");
  for (const char* nothing : {"", "# only a comment\n", "matcher:\n", "---\n"}) EXPECT_TRUE(parse(nothing)) << nothing;
}

TEST(Options, GroupsNest) {
  const auto options =
      parse("threads: 2\nmatcher: {method: block, enabled: false, lengths_m: [3, 4.5], speckle: {difference_px: 2}}");
  ASSERT_TRUE(options) << options.error().message();
  EXPECT_EQ(options->threads, 2);
  EXPECT_EQ(options->matcher.method, "block");
  EXPECT_FALSE(options->matcher.enabled);
  EXPECT_EQ(options->matcher.lengths_m, (std::vector<double>{3, 4.5}));
  EXPECT_EQ(options->matcher.speckle.difference_px, 2);
}

TEST(Options, UnknownKeysAreReportedWithTheirLine) {
  const std::string error = error_of("threads: 2\nmatcher:\n  speckle:\n    size_pixels: 3\n");
  EXPECT_THAT(error, HasSubstr("run.yaml:4: matcher.speckle.size_pixels: unknown key"));
  EXPECT_THAT(error, HasSubstr("size_px")) << "lists the known keys";
}

TEST(Options, AllErrorsAreReportedAtOnce) {
  const std::string error = error_of(
      "threads: 99\n"
      "matcher:\n"
      "  enabled: perhaps\n"
      "  method: magic\n"
      "  lengths_m: [1, -2]\n"
      "  gain: .nan\n"
      "  speckle: 5\n"
      "  extra: 1\n"
      "depth: 3\n");
  EXPECT_THAT(error, HasSubstr("run.yaml:1: threads: is 99, must be between 1 and 64"));
  EXPECT_THAT(error, HasSubstr("run.yaml:3: matcher.enabled: must be true or false"));
  EXPECT_THAT(error, HasSubstr("run.yaml:4: matcher.method: is 'magic', must be one of: sgm, block"));
  EXPECT_THAT(error, HasSubstr("run.yaml:5: matcher.lengths_m: holds -2, must be at least 0"));
  EXPECT_THAT(error, HasSubstr("run.yaml:6: matcher.gain: is .nan, must be a finite number"));
  EXPECT_THAT(error, HasSubstr("run.yaml:7: matcher.speckle: must be a group of `key: value` lines"));
  EXPECT_THAT(error, HasSubstr("run.yaml:8: matcher.extra: unknown key"));
  EXPECT_THAT(error, HasSubstr("run.yaml:9: depth: unknown key"));
}

TEST(Options, WrongTypesAreRejected) {
  EXPECT_THAT(error_of("threads: 1.5"), HasSubstr("whole number"));
  EXPECT_THAT(error_of("threads: 99999999999"), HasSubstr("whole number"));
  EXPECT_THAT(error_of("threads:"), HasSubstr("whole number"));
  EXPECT_THAT(error_of("threads: [1]"), HasSubstr("whole number"));
  EXPECT_THAT(error_of("matcher: {gain: wide}"), HasSubstr("run.yaml:1: matcher.gain: 'wide' is not a number"));
  EXPECT_THAT(error_of("matcher: {note: }"), HasSubstr("must be text"));
  EXPECT_THAT(error_of("matcher: {lengths_m: 3}"), HasSubstr("list of numbers"));
  EXPECT_THAT(error_of("matcher: {speckle: {difference_px: 1e99}}"), HasSubstr("between 0 and 10"));
  EXPECT_THAT(error_of("matcher: {gain: 1e999}"), HasSubstr("number"));
}

TEST(Options, InvalidYamlIsRejected) {
  EXPECT_THAT(error_of("threads: 1\nmatcher: {"), HasSubstr("run.yaml:"));
  EXPECT_THAT(error_of("- 1\n- 2\n"), HasSubstr("run.yaml:1"));
  EXPECT_THAT(error_of("just text"), HasSubstr("run.yaml:1"));
  EXPECT_THAT(error_of("threads: 1\nthreads: 2\n"), HasSubstr("run.yaml:1: threads: is given twice, again in line 2"));
}

TEST(Options, LoadsFiles) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(load_options<RunOptions>(folder.write("a.yaml", "threads: 4"))->threads, 4);
  EXPECT_TRUE(load_options<RunOptions>(folder.write("empty.yaml", "")));
  const auto missing = load_options<RunOptions>(folder.path() + "/none.yaml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::configuration);
  EXPECT_EQ(missing.error().where, folder.path() + "/none.yaml");
}

TEST(Options, AppliesAssignments) {
  auto options = set_option(RunOptions{}, "matcher.speckle.size_px=12");
  ASSERT_TRUE(options) << options.error().message();
  options = set_option(*options, "matcher.lengths_m=[5, 10]");
  ASSERT_TRUE(options);
  options = set_option(*options, "matcher.note=a = b");
  ASSERT_TRUE(options);
  EXPECT_EQ(options->matcher.speckle.size_px, 12);
  EXPECT_EQ(options->matcher.lengths_m, (std::vector<double>{5, 10}));
  EXPECT_EQ(options->matcher.note, "a = b");
  EXPECT_EQ(options->threads, 1);
}

TEST(Options, InvalidAssignmentsAreUsageErrors) {
  for (const char* assignment : {"threads", "=3", "threads=", "threads=0", "thread=2", "matcher=3", "threads.x=1",
                                 "matcher.note=[", "matcher.gain=1}, threads: {2", "..=1"}) {
    const auto options = set_option(RunOptions{}, assignment);
    ASSERT_FALSE(options) << assignment;
    EXPECT_EQ(options.error().code, ErrorCode::usage) << assignment;
    EXPECT_THAT(options.error().message(), HasSubstr("--set"));
  }
  EXPECT_THAT(set_option(RunOptions{}, "threads=0").error().message(), Not(HasSubstr("=0:1"))) << "no line numbers";
}

TEST(Options, ListsEveryOptionInOrder) {
  const auto lines = list_options(RunOptions{});
  ASSERT_EQ(lines.size(), 8U);
  EXPECT_EQ(lines[0].key, "matcher.enabled");
  EXPECT_EQ(lines[1].meaning, "Matching method. (sgm | block)");
  EXPECT_EQ(lines[5].key, "matcher.speckle.size_px");
  EXPECT_EQ(lines[5].value, "100");
  EXPECT_TRUE(lines[5].meaning.ends_with(" (at least 0)")) << lines[5].meaning;
  EXPECT_EQ(lines[7].key, "threads");
}

struct MaskedOptions {
  int before = 0;
  std::vector<MaskOptions> masks{{"built-in", 3}};
  int after = 0;
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("before", before, "A key before the list.");
    v.list("masks", masks, "Masked regions.");
    v.field("after", after, "A key after the list.");
  }
};

TEST(OptionLists, AGivenListReplacesTheWholeList) {
  const auto kept = parse_options<MaskedOptions>("before: 1\n", "m.yaml");
  ASSERT_TRUE(kept);
  ASSERT_EQ(kept->masks.size(), 1U);
  EXPECT_EQ(kept->masks[0].name, "built-in");
  const auto given =
      parse_options<MaskedOptions>("masks:\n  - {name: sky, rows: 2}\n  - name: wheel\nafter: 5\n", "m.yaml");
  ASSERT_TRUE(given) << given.error().message();
  ASSERT_EQ(given->masks.size(), 2U);
  EXPECT_EQ(given->masks[0].rows, 2);
  EXPECT_EQ(given->masks[1].name, "wheel");
  EXPECT_EQ(given->masks[1].rows, 1) << "the item's own default";
  EXPECT_EQ(given->after, 5);
  const auto none = parse_options<MaskedOptions>("masks: []\n", "m.yaml");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->masks.empty());
}

TEST(OptionLists, ErrorsNameTheItemAndItsLine) {
  const auto bad = parse_options<MaskedOptions>(
      "masks:\n  - {name: sky, rows: 12}\n  - {nam: wheel}\n  - 3\n  - {rows: two}\n", "m.yaml");
  ASSERT_FALSE(bad);
  const std::string message = bad.error().message();
  EXPECT_THAT(message, HasSubstr("m.yaml:2: masks[0].rows: is 12, must be between 1 and 9"));
  EXPECT_THAT(message, HasSubstr("m.yaml:3: masks[1].nam: unknown key"));
  EXPECT_THAT(message, HasSubstr("m.yaml:4: masks[2]: must be a group"));
  EXPECT_THAT(message, HasSubstr("m.yaml:5: masks[3].rows: 'two' is not a whole number"));
  for (const char* text : {"masks: 3", "masks: {name: sky}", "masks: sky"})
    EXPECT_THAT(parse_options<MaskedOptions>(text, "m.yaml").error().message(), HasSubstr("m.yaml:1: masks: must be"));
}

TEST(OptionLists, AreDumpedOnOneLine) {
  MaskedOptions options;
  options.masks = {{"a, b: {c}", 2}, {"", 9}, {"[#\"'", 1}};
  const auto lines = list_options(options);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[1].key, "masks");
  const auto back = parse_options<MaskedOptions>(dump_options(options), "m.yaml");
  ASSERT_TRUE(back) << back.error().message();
  ASSERT_EQ(back->masks.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back->masks[i].name, options.masks[i].name);
    EXPECT_EQ(back->masks[i].rows, options.masks[i].rows);
  }
}

TEST(OptionLists, LocationOfAnOptionIsItsLine) {
  const std::string text = "before: 1\nmasks:\n  - {name: sky}\nmatcher:\n  speckle:\n    size_px: 3\n";
  EXPECT_EQ(option_location(text, "m.yaml", "masks"), "m.yaml:2: masks");
  EXPECT_EQ(option_location(text, "m.yaml", "matcher.speckle.size_px"), "m.yaml:6: matcher.speckle.size_px");
  EXPECT_EQ(option_location(text, "m.yaml", "after"), "m.yaml: after");
}

RC_GTEST_PROP(Options, DumpsParseToTheSameBits, (double gain, bool enabled, int size)) {
  RC_PRE(std::isfinite(gain));
  RunOptions options;
  options.matcher.gain = gain;
  options.matcher.enabled = enabled;
  options.matcher.speckle.size_px = size & 0x7FFFFFFF;
  options.matcher.note = *rc::gen::container<std::string>(rc::gen::inRange<char>(' ', 127));
  options.matcher.lengths_m = {std::abs(gain), std::nextafter(1.0, 2.0), 5e-324, 1.7976931348623157e308};
  const auto back = parse(dump_options(options));
  if (!back) RC_FAIL(back.error().message());
  RC_ASSERT(std::bit_cast<std::uint64_t>(back->matcher.gain) == std::bit_cast<std::uint64_t>(gain));
  RC_ASSERT(back->matcher.enabled == enabled);
  RC_ASSERT(back->matcher.speckle.size_px == options.matcher.speckle.size_px);
  RC_ASSERT(back->matcher.note == options.matcher.note);
  RC_ASSERT(back->matcher.lengths_m == options.matcher.lengths_m);
}

enum class Filter { none, median, bilateral };
constexpr auto enum_names(Filter) {
  return std::array{EnumName{Filter::none, "none"}, EnumName{Filter::median, "median"},
                    EnumName{Filter::bilateral, "bilateral"}};
}

struct FilterOptions {
  Filter filter = Filter::median;
  int radius_px = 1;
  std::vector<double> weights{1, 2, 1};
  SpeckleOptions speckle;
  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("smoothing", "filter");
    v.field("filter", filter, "how disparities are filtered");
    v.renamed("radius", "radius_px");
    v.field("radius_px", radius_px, "half the window", between(1, 9));
    v.field("weights", weights, "of three neighbours", between(0, 10));
    v.renamed("islands", "speckle");
    v.group("speckle", speckle);
  }
};

Result<FilterOptions> parse_filter(const std::string& text) {
  return parse_options<FilterOptions>(text, "f.yaml");
}
std::string filter_fault_of(const std::string& text) {
  const auto result = parse_filter(text);
  EXPECT_FALSE(result) << text;
  return result ? std::string() : result.error().message();
}

TEST(EnumOptions, AreReadAndListedByName) {
  EXPECT_EQ(name_of(Filter::bilateral), "bilateral");
  EXPECT_EQ(value_named<Filter>("none"), Filter::none);
  EXPECT_EQ(value_named<Filter>("gaussian"), std::nullopt);
  EXPECT_EQ(parse_filter("filter: bilateral")->filter, Filter::bilateral);
  EXPECT_EQ(parse_filter("radius_px: 2")->filter, Filter::median) << "not named: the default stays";
  EXPECT_EQ(set_option(FilterOptions{}, "filter=none")->filter, Filter::none);
  FilterOptions options;
  options.filter = Filter::bilateral;
  const auto lines = list_options(options);
  EXPECT_EQ(lines[0].value, "\"bilateral\"");
  EXPECT_EQ(lines[0].meaning, "how disparities are filtered (none | median | bilateral)");
  for (const Filter filter : {Filter::none, Filter::median, Filter::bilateral}) {
    options.filter = filter;
    EXPECT_EQ(parse_filter(dump_options(options))->filter, filter);
  }
}

TEST(EnumOptions, OtherNamesAreRefused) {
  for (const char* text : {"filter: gaussian", "filter: Median", "filter: 1"})
    EXPECT_THAT(filter_fault_of(text), HasSubstr("f.yaml:1: filter: is '")) << text;
  EXPECT_THAT(filter_fault_of("filter: gaussian"), HasSubstr("must be one of: none, median, bilateral"));
  EXPECT_THAT(filter_fault_of("filter: [none]"), HasSubstr("f.yaml:1: filter: must be text"));
}

TEST(RenamedOptions, FormerNamesAreAcceptedWithAWarning) {
  const std::string text = "smoothing: none\nradius: 3\nislands:\n  size_px: 7\n";
  const auto options = parse_filter(text);
  ASSERT_TRUE(options) << options.error().message();
  EXPECT_EQ(options->filter, Filter::none);
  EXPECT_EQ(options->radius_px, 3);
  EXPECT_EQ(options->speckle.size_px, 7);
  const auto warnings = read_options<FilterOptions>(text, "f.yaml")->warnings;
  ASSERT_EQ(warnings.size(), 3U);
  EXPECT_THAT(warnings[0], HasSubstr("f.yaml:1: smoothing is now called filter"));
  EXPECT_THAT(warnings[1], HasSubstr("f.yaml:2: radius is now called radius_px"));
  EXPECT_THAT(warnings[2], HasSubstr("islands is now called speckle"));
  EXPECT_EQ(read_options<FilterOptions>("filter: none\nradius_px: 3\n", "f.yaml")->warnings.size(), 0U);
}

TEST(RenamedOptions, TheCommandLineKnowsThemToo) {
  EXPECT_EQ(set_option(FilterOptions{}, "radius=4")->radius_px, 4);
  EXPECT_EQ(set_option(FilterOptions{}, "islands.size_px=4")->speckle.size_px, 4);
  const auto warnings = read_assignment<FilterOptions>("islands.size_px=4")->warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], HasSubstr("islands is now called speckle"));
}

TEST(RenamedOptions, AreCheckedAsTheirSuccessors) {
  EXPECT_THAT(filter_fault_of("radius: 12"), HasSubstr("radius_px: is 12, must be between 1 and 9"));
  EXPECT_THAT(filter_fault_of("radius: 2\nradius_px: 2\n"),
              HasSubstr("f.yaml:1: radius: is the former name of radius_px, which is given too"));
  EXPECT_THAT(filter_fault_of("islands: {size: 2}"), HasSubstr("speckle.size: unknown key"));
  const std::string fault = filter_fault_of("window: 3");
  EXPECT_THAT(fault, HasSubstr("window: unknown key"));
  EXPECT_THAT(fault, Not(HasSubstr("smoothing"))) << "former names are not among the known ones";
}

TEST(ValidateOptions, DefaultsAreGood) {
  EXPECT_TRUE(validate(RunOptions{}, "run options"));
  EXPECT_TRUE(validate(FilterOptions{}, "filter options"));
  EXPECT_TRUE(validate(MaskedOptions{}, "masks"));
}

TEST(ValidateOptions, EveryFieldThatIsWrongIsNamed) {
  RunOptions options;
  options.threads = 99;
  options.matcher.method = "magic";
  options.matcher.gain = std::numeric_limits<double>::infinity();
  options.matcher.lengths_m = {1, -2};
  options.matcher.speckle.size_px = -1;
  options.matcher.speckle.difference_px = std::numeric_limits<double>::quiet_NaN();
  const Status checked = validate(options, "run options");
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::configuration);
  EXPECT_EQ(checked.error().where, "run options");
  EXPECT_EQ(checked.error().what,
            "matcher.method is 'magic', must be one of: sgm, block\n"
            "matcher.lengths_m holds -2, must be at least 0\n"
            "matcher.gain must be a finite number\n"
            "matcher.speckle.size_px is -1, must be at least 0\n"
            "matcher.speckle.difference_px must be a finite number\n"
            "threads is 99, must be between 1 and 64");
}

TEST(ValidateOptions, BoundsThemselvesAreInside) {
  for (const int threads : {1, 64}) {
    RunOptions options;
    options.threads = threads;
    EXPECT_TRUE(validate(options, "run options")) << threads;
  }
  for (const int threads : {0, 65}) {
    RunOptions options;
    options.threads = threads;
    EXPECT_FALSE(validate(options, "run options")) << threads;
  }
}

TEST(ValidateOptions, NotANumberInAListIsRefused) {
  FilterOptions options;
  options.weights = {1, std::numeric_limits<double>::quiet_NaN(), 1};
  EXPECT_THAT(validate(options, "filter options").error().message(), HasSubstr("weights holds nan"));
}

TEST(ValidateOptions, AnEnumHoldsOneOfItsValues) {
  FilterOptions options;
  options.filter = static_cast<Filter>(17);
  EXPECT_EQ(name_of(options.filter), "");
  EXPECT_THAT(validate(options, "filter options").error().message(),
              HasSubstr("filter is not one of the values of its enum"));
}

TEST(ValidateOptions, ItemsOfListsAreNamed) {
  MaskedOptions options;
  options.masks = {{"sky", 2}, {"wheel", 12}};
  EXPECT_THAT(validate(options, "masks").error().message(), HasSubstr("masks[1].rows is 12, must be between 1 and 9"));
}

TEST(OptionKeys, ThatWereGivenAreKnown) {
  const auto read = read_options<RunOptions>("matcher:\n  gain: 0.1\n  speckle: {}\n", "run.yaml");
  ASSERT_TRUE(read) << read.error().message();
  GivenKeys given = read->given;
  given.add(read_assignment<RunOptions>("matcher.speckle.size_px=100")->given);
  EXPECT_TRUE(given.contains("matcher.gain")) << "given, though it is the default";
  EXPECT_TRUE(given.contains("matcher.speckle.size_px"));
  EXPECT_FALSE(given.contains("matcher.speckle.difference_px"));
  EXPECT_FALSE(given.contains("threads"));
  EXPECT_TRUE(given.in_group("matcher").contains("gain"));
  EXPECT_TRUE(given.in_group("matcher.speckle").contains("size_px"));
  EXPECT_FALSE(given.in_group("match").contains("gain"));
  EXPECT_TRUE(read_options<FilterOptions>("radius: 3", "f.yaml")->given.contains("radius_px")) << "by its present name";
}

}  // namespace
}  // namespace spartan
