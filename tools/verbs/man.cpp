/// loam man: the manual page, made of the verbs' own definitions and of the table of keys.
#include <cstdio>

#include "tools/play/controls.h"
#include "tools/verb.h"

namespace tools {

namespace {

/// As troff must have it.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\\\";
    else if (c == '-')
      out += "\\-";
    else if (c == '\n')
      out += "\n.br\n";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      out += std::string("\\&") + c;
    else
      out += c;
  }
  return out;
}

void print_options(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    std::printf(".TP\n.B %s\n%s\n", escaped(option->get_name(false, true)).c_str(),
                escaped(option->get_description()).c_str());
  }
}

int print_manual(CLI::App& app) {
  std::printf(".TH LOAM 1 \"\" loam \"User Commands\"\n.SH NAME\nloam \\- a voxel world simulator and renderer\n");
  std::printf(".SH SYNOPSIS\n.B loam\n.I VERB\n[\\fIOPTION\\fR]...\n.SH DESCRIPTION\n");
  std::printf(
      "Generates, imports, simulates and draws worlds made of voxels. Data goes to the standard output, what is to be "
      "said of the work to the standard error. Each verb has\n.B \\-\\-help.\n");
  for (const CLI::App* verb : app.get_subcommands({})) {
    if (verb->get_group().empty()) continue;
    std::printf(".SS loam %s\n%s.\n", escaped(verb->get_name()).c_str(), escaped(verb->get_description()).c_str());
    print_options(*verb);
  }
  std::printf(".SH KEYS OF LOAM PLAY\nBy their places on a US keyboard.\n");
  const Bindings bindings;
  for (const ActionRow& row : action_rows())
    std::printf(".TP\n.B %s\n%s\n", escaped(bindings.text(row.action)).c_str(), escaped(row.what).c_str());
  std::printf(
      ".SH FILES\n.TP\n.I $XDG_CONFIG_HOME/loam/play.toml\nsettings of play\n.TP\n"
      ".I $XDG_DATA_HOME/loam/worlds, $XDG_DATA_HOME/loam/screenshots\nworlds and pictures of play\n");
  std::printf(".SH EXIT STATUS\n0 fine, 1 a comparison failed, 2 usage, 3 input or output, 4 no device, 5 unstable\n");
  return 0;
}

}  // namespace

void add_man_verb(CommandLine& command) {
  CLI::App* verb = command.verb("man", "print the manual page: loam man | man -l -");
  command.action(verb, [app = &command.app]() -> world::Result<int> { return print_manual(*app); });
}

}  // namespace tools
