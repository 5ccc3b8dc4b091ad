#include "program/command_line.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/core/strict_yaml.h"

namespace spartan::program {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// "did you mean `run`? "
std::string suggestion(const std::string& word, const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  const std::string meant = closest_name(word, names);
  return meant.empty() ? "" : fmt::format("did you mean `{}`? ", meant);
}

}  // namespace

void refuse_empty_arguments(CLI::App& app) {
  const CLI::Validator not_empty(
      [](const std::string& text) { return text.empty() ? "the argument is empty" : std::string(); }, "");
  for (CLI::Option* option : app.get_options()) option->check(not_empty);
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) refuse_empty_arguments(*command);
}

std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* group = &app;
  std::string path = "spartan";
  bool after_option = false;  // the word may be its value
  for (const std::string& word : words) {
    const auto commands = commands_of(*group);
    if (commands.empty()) return {};
    if (word.starts_with('-')) {
      const std::string name = word.substr(0, word.find('='));
      if (group->get_option_no_throw(name) == nullptr)
        return fmt::format("error: '{}' is not an option of {}; see `{} --help`\n", name, path, path);
      after_option = true;
      continue;
    }
    const auto named = std::find_if(commands.begin(), commands.end(),
                                    [&](const CLI::App* command) { return command->check_name(word); });
    if (named == commands.end()) {
      if (after_option) return {};
      return fmt::format("error: '{0}' is not a {1} command; {2}see `{1} --help`\n", word, path,
                         suggestion(word, commands));
    }
    group = *named;
    path += " " + word;
    after_option = false;
  }
  return {};
}

std::string command_of(const CLI::App& app) {
  const auto parsed = app.get_subcommands();
  return app.get_name() + (parsed.empty() ? "" : " " + command_of(*parsed.front()));
}

bool lacks_command(const CLI::App& app) {
  const CLI::App* group = &app;
  while (!group->get_subcommands().empty()) group = group->get_subcommands().front();
  return !commands_of(*group).empty();
}

std::vector<std::string> words_of(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  return words;
}

std::string command_line(int argc, char** argv) {
  std::string line = "spartan";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                            "0123456789_-+=./:,@%") == std::string::npos;
    std::string quoted;
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += plain ? " " + word : " '" + quoted + "'";
  }
  return line;
}

}  // namespace spartan::program
