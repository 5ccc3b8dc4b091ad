#include "program/command_docs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "program/commands.h"

namespace spartan::program {
namespace {

// A command with the words that select it: "map build". The program itself has none.
struct NamedCommand {
  std::string path;
  const CLI::App* command;
};

void collect(const CLI::App& app, const std::string& path, std::vector<NamedCommand>& commands) {
  commands.push_back({path, &app});
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    collect(*sub, path.empty() ? sub->get_name() : path + " " + sub->get_name(), commands);
}

std::vector<NamedCommand> all_commands(const CLI::App& app) {
  std::vector<NamedCommand> commands;
  collect(app, "", commands);
  return commands;
}

std::vector<std::string> subcommand_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  return names;
}

// Options that help shows: former names have no group.
std::vector<const CLI::Option*> shown_options(const CLI::App& app) {
  std::vector<const CLI::Option*> options = app.get_options();
  std::erase_if(options, [](const CLI::Option* option) { return option->get_group().empty(); });
  return options;
}

// "--threads", "-o".
std::vector<std::string> flags_of(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_snames()) flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) flags.push_back("--" + name);
  return flags;
}

std::vector<std::string> flags_of(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : shown_options(app)) {
    for (std::string& flag : flags_of(*option)) flags.push_back(std::move(flag));
  }
  return flags;
}

std::string bash_script(const CLI::App& app) {
  std::string select, complete;
  for (const auto& [path, command] : all_commands(app)) {
    if (!path.empty()) select += fmt::format("      \"{0}\") path=\"{0}\" ;;\n", path);
    complete += fmt::format("    \"{}\") words=\"{} {}\" ;;\n", path, fmt::join(subcommand_names(*command), " "),
                            fmt::join(flags_of(*command), " "));
  }
  return "_spartan() {\n  local current=${COMP_WORDS[COMP_CWORD]} path= word words=\n"
         "  for word in \"${COMP_WORDS[@]:1:$((COMP_CWORD-1))}\"; do\n    case \"${path:+$path }$word\" in\n" +
         select + "    esac\n  done\n  case $path in\n" + complete +
         "  esac\n  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "  [[ $current == -* ]] || COMPREPLY+=($(compgen -f -- \"$current\"))\n}\n"
         "complete -o filenames -F _spartan spartan\n";
}

std::string quoted_for_fish(std::string text) {
  for (std::size_t i = 0; (i = text.find_first_of("\\'", i)) != std::string::npos; i += 2) text.insert(i, 1, '\\');
  return "'" + text + "'";
}

std::string fish_script(const CLI::App& app) {
  std::string script;
  for (const auto& [path, command] : all_commands(app)) {
    const std::string name = path.substr(path.rfind(' ') == std::string::npos ? 0 : path.rfind(' ') + 1);
    const std::string condition = path.empty() ? "__fish_use_subcommand" : "__fish_seen_subcommand_from " + name;
    for (const CLI::App* sub : command->get_subcommands([](const CLI::App*) { return true; })) {
      script += fmt::format("complete -c spartan -n '{}' -a {} -d {}\n", condition, sub->get_name(),
                            quoted_for_fish(sub->get_description()));
    }
    for (const CLI::Option* option : shown_options(*command)) {
      std::string flags;
      for (const std::string& s : option->get_snames()) flags += " -s " + s;
      for (const std::string& l : option->get_lnames()) flags += " -l " + l;
      if (flags.empty()) continue;
      script +=
          fmt::format("complete -c spartan -n '{}'{}{} -d {}\n", condition, flags,
                      option->get_items_expected_max() > 0 ? " -r" : "", quoted_for_fish(option->get_description()));
    }
  }
  return script;
}

// Text of a roff document: a leading period or quote would be a request, "\" and "-" have a meaning of their own.
std::string roff(const std::string& text) {
  std::string safe = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    if (c == '\\') {
      safe += "\\e";
    } else if (c == '-') {
      safe += "\\-";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string roff_option(const CLI::Option& option) {
  const std::vector<std::string> flags = flags_of(option);
  std::string name = flags.empty() ? option.get_name(true) : fmt::format("{}", fmt::join(flags, ", "));
  if (!flags.empty() && option.get_items_expected_max() > 0) {
    const std::string& text = option.get_option_text();
    name += " " + (text.empty() ? option.get_type_name() : text.substr(0, text.find(' ')));
  }
  return fmt::format(".TP\n.B {}\n{}\n", roff(name), roff(option.get_description()));
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  if (shell == "fish") return fish_script(app);
  // As a file of $fpath, zsh runs it at the first completion of the command that its first line names.
  if (shell == "zsh") {
    return "#compdef spartan\nautoload -U +X bashcompinit && bashcompinit\n" + bash_script(app) +
           "[[ ${funcstack[1]} != _spartan ]] || _bash_complete -o filenames -F _spartan\n";
  }
  return bash_script(app);
}

std::string man_page(const CLI::App& app, const std::string& version) {
  std::string page = fmt::format(
      ".TH SPARTAN 1 \"\" \"Spartan {}\"\n.SH NAME\nspartan \\- {}\n.SH SYNOPSIS\n.B spartan\n"
      ".I command\n[options]\n.SH COMMANDS\n",
      version, roff(app.get_description()));
  for (const auto& [path, command] : all_commands(app)) {
    if (path.empty() || !subcommand_names(*command).empty()) continue;
    page += fmt::format(".SS spartan {}\n{}\n", path, roff(command->get_description()));
    for (const CLI::Option* option : shown_options(*command)) page += roff_option(*option);
    if (!command->get_footer().empty()) page += ".PP\n.nf\n" + roff(command->get_footer()) + "\n.fi\n";
  }
  return page +
         ".SH EXIT STATUS\n0 success, 1 internal fault, 2 wrong command line, 3 input, 4 calibration or configuration, "
         "5 output, 6 lost for part of the drive, 7 bad calibration, 130 interrupted.\n";
}

void add_completion(CLI::App& app, Context& context) {
  auto shell = std::make_shared<std::string>();
  CLI::App* completion = add_command(app, context, "completion", "Print a completion script for a shell",
                                     "completion bash >~/.local/share/bash-completion/completions/spartan",
                                     [&app, shell]() -> Result<ExitCode> {
                                       if (Status s = print(completion_script(app, *shell)); !s) return failure(s);
                                       return kDone;
                                     });
  completion->add_option("shell", *shell, "Shell: bash, zsh or fish.")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  add_command(app, context, "man", "Print the man page of spartan in roff", "man | man -l -",
              [&app]() -> Result<ExitCode> {
                if (Status s = print(man_page(app, SPARTAN_VERSION)); !s) return failure(s);
                return kDone;
              });
}

}  // namespace spartan::program
