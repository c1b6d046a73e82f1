#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/cli/command.h"

namespace penumbra::cli {

namespace {

struct Flag {
  std::string name;         // --output
  std::string description;  // of its use
  bool takes_value = false;
  std::vector<std::string> values;  // where only some are taken
};

/// What may follow `penumbra PATH`: other commands, or flags, values and files.
struct Place {
  std::string path;                                           // as in "key create"; empty: the program itself
  std::vector<std::pair<std::string, std::string>> commands;  // with what each is for
  std::vector<Flag> flags;
  std::vector<std::string> values;  // of an argument that takes only these
};

/// Of CLI11's description of what an option takes, as in "TEXT:{a,b}", the values.
std::vector<std::string> values_of(const std::string& type) {
  const std::size_t begin = type.find('{'), end = type.find('}', begin);
  if (end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

void add_places(const CLI::App& app, const std::string& path, std::vector<Place>& places) {
  Place place{path, {}, {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    const std::vector<std::string> values = values_of(option->get_type_name());
    if (option->get_positional()) place.values = values;
    const auto add = [&](const std::string& name) {
      place.flags.push_back({name, option->get_description(), option->get_items_expected_max() > 0, values});
    };
    for (const std::string& name : option->get_lnames()) add("--" + name);
    for (const std::string& name : option->get_snames()) add("-" + name);
  }
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* command : commands) place.commands.emplace_back(command->get_name(), command->get_description());
  places.push_back(std::move(place));
  for (const CLI::App* command : commands)
    add_places(*command, path.empty() ? command->get_name() : path + " " + command->get_name(), places);
}

/// In single quotes, where `quote_inside` stands for one.
std::string quoted(const std::string& text, const std::string& quote_inside) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? quote_inside : std::string(1, c);
  return result + "'";
}
std::string for_sh(const std::string& text) { return quoted(text, "'\\''"); }

std::string paths_of(const std::vector<Place>& places) {
  std::string result;
  for (const Place& place : places) {
    if (!place.path.empty()) result += (result.empty() ? "" : "|") + for_sh(place.path);
  }
  return result;
}

/// Shell lines that find in `words`, from `first` to before `end`, the path of the command that is being written.
std::string find_path(const std::vector<Place>& places, const std::string& words, int first, const std::string& end) {
  return "  local place= i\n  for ((i = " + std::to_string(first) + "; i < " + end +
         "; i++)); do\n    case \"${place:+$place }${" + words + "[i]}\" in\n      " + paths_of(places) +
         ") place=\"${place:+$place }${" + words + "[i]}\" ;;\n    esac\n  done\n";
}

/// The patterns, joined, of PATH and flag for those whose values are any: files, as all shells complete them by
/// themselves.
std::string any_valued(const Place& place) {
  std::string result;
  for (const Flag& flag : place.flags) {
    if (flag.takes_value && flag.values.empty())
      result += (result.empty() ? "" : "|") + for_sh(place.path + " " + flag.name);
  }
  return result;
}

void print_bash(const std::vector<Place>& places, std::ostream& out) {
  const auto match = [](const std::string& words) {
    return "mapfile -t COMPREPLY < <(compgen -W " + words + " -- \"$word\")";
  };
  out << "_penumbra() {\n  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} found=\n"
      << find_path(places, "COMP_WORDS", 1, "COMP_CWORD") << "  COMPREPLY=()\n  case \"$place $before\" in\n";
  for (const Place& place : places) {
    if (const std::string any = any_valued(place); !any.empty()) out << "    " << any << ") return ;;\n";
    for (const Flag& flag : place.flags) {
      if (!flag.values.empty())
        out << "    " << for_sh(place.path + " " + flag.name) << ") "
            << match(for_sh(CLI::detail::join(flag.values, " "))) << "; return ;;\n";
    }
  }
  out << "  esac\n  case $place in\n";
  for (const Place& place : places) {
    std::string words = CLI::detail::join(place.values, " "), flags;
    for (const auto& [name, description] : place.commands) words += name + " ";
    for (const Flag& flag : place.flags) flags += flag.name + " ";
    out << "    " << for_sh(place.path) << ") found=" << for_sh(words)
        << "; [[ $word != -* ]] || found=" << for_sh(flags) << " ;;\n";
  }
  out << "  esac\n  " << match("\"$found\"") << "\n}\ncomplete -o default -F _penumbra penumbra\n";
}

void print_zsh(const std::vector<Place>& places, std::ostream& out) {
  const auto described = [](const std::string& name, const std::string& description) {
    return for_sh(name + ":" + description) + " ";
  };
  out << "#compdef penumbra\n_penumbra() {\n  local before=${words[CURRENT - 1]}\n  local -a found\n"
      << find_path(places, "words", 2, "CURRENT") << "  case \"$place $before\" in\n";
  for (const Place& place : places) {
    if (const std::string any = any_valued(place); !any.empty()) out << "    " << any << ") _files; return ;;\n";
    for (const Flag& flag : place.flags) {
      if (!flag.values.empty())
        out << "    " << for_sh(place.path + " " + flag.name) << ") compadd " << CLI::detail::join(flag.values, " ")
            << "; return ;;\n";
    }
  }
  out << "  esac\n  case $place in\n";
  for (const Place& place : places) {
    out << "    " << for_sh(place.path) << ")\n      found=(" << CLI::detail::join(place.values, " ");
    for (const auto& [name, description] : place.commands) out << described(name, description);
    out << ")\n      [[ ${words[CURRENT]} != -* ]] || found=(";
    for (const Flag& flag : place.flags) out << described(flag.name, flag.description);
    out << ") ;;\n";
  }
  out << "  esac\n  if (($#found)); then _describe penumbra found; else _files; fi\n}\n"
      << "if [[ ${funcstack[1]} == _penumbra ]]; then _penumbra \"$@\"; else compdef _penumbra penumbra; fi\n";
}

void print_fish(const std::vector<Place>& places, std::ostream& out) {
  const auto for_fish = [](const std::string& text) { return quoted(text, "\\'"); };
  for (const Place& place : places) {
    std::string condition, names;
    for (const std::string& word : CLI::detail::split(place.path, ' '))
      condition +=
          word.empty() ? "true" : (condition.empty() ? "" : "; and ") + ("__fish_seen_subcommand_from " + word);
    for (const auto& [name, description] : place.commands) names += " " + name;
    if (!names.empty()) condition += "; and not __fish_seen_subcommand_from" + names;
    const std::string start = "complete -c penumbra -n " + for_fish(condition);
    for (const auto& [name, description] : place.commands)
      out << start << " -f -a " << for_fish(name) << " -d " << for_fish(description) << "\n";
    if (!place.values.empty()) out << start << " -f -a " << for_fish(CLI::detail::join(place.values, " ")) << "\n";
    for (const Flag& flag : place.flags) {
      out << start << (flag.name.starts_with("--") ? " -l " + flag.name.substr(2) : " -s " + flag.name.substr(1));
      if (flag.takes_value) out << " -r";
      if (!flag.values.empty()) out << " -f -a " << for_fish(CLI::detail::join(flag.values, " "));
      out << " -d " << for_fish(flag.description) << "\n";
    }
  }
}

}  // namespace

Command add_completion(CLI::App& program) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = program.add_subcommand(
      "completion", "Print what lets a shell complete commands and flags, as in: source <(penumbra completion bash)");
  command->add_option("shell", *shell, "bash, zsh or fish")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  return {command, [&program, shell] {
            std::vector<Place> places;
            add_places(program, "", places);
            if (*shell == "bash") print_bash(places, std::cout);
            if (*shell == "zsh") print_zsh(places, std::cout);
            if (*shell == "fish") print_fish(places, std::cout);
            return status_done;
          }};
}

}  // namespace penumbra::cli
