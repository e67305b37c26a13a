/// loam completion: what bash needs to complete the command's verbs and flags, made of their own definitions.
#include <cstdio>

#include "tools/verb.h"

namespace tools {

namespace {

std::string flags_of(const CLI::App& app) {
  std::string all;
  for (const CLI::Option* option : app.get_options())
    if (!option->get_lnames().empty() && !option->get_group().empty())
      for (const std::string& name : option->get_lnames()) all += (all.empty() ? "--" : " --") + name;
  return all;
}

int print_completion(CLI::App& app) {
  std::string verbs;
  for (const CLI::App* verb : app.get_subcommands({}))
    if (!verb->get_group().empty()) verbs += (verbs.empty() ? "" : " ") + verb->get_name();
  std::printf("# bash completion for loam; written by `loam completion`\n_loam() {\n");
  std::printf("  local word=${COMP_WORDS[COMP_CWORD]} flags=\n  COMPREPLY=()\n");
  std::printf(
      "  if [[ $COMP_CWORD -eq 1 ]]; then\n    COMPREPLY=($(compgen -W '%s --help --version' -- \"$word\"))\n    "
      "return\n  fi\n",
      verbs.c_str());
  std::printf("  case ${COMP_WORDS[1]} in\n");
  for (const CLI::App* verb : app.get_subcommands({}))
    std::printf("    %s) flags='%s' ;;\n", verb->get_name().c_str(), flags_of(*verb).c_str());
  std::printf("  esac\n  if [[ $word == -* ]]; then\n    COMPREPLY=($(compgen -W \"$flags\" -- \"$word\"))\n  else\n");
  std::printf("    compopt -o default\n  fi\n}\ncomplete -F _loam loam\n");
  return 0;
}

}  // namespace

void add_completion_verb(CommandLine& command) {
  CLI::App* verb =
      command.verb("completion", "print what bash needs to complete this command: source <(loam completion)");
  command.action(verb, [app = &command.app]() -> world::Result<int> { return print_completion(*app); });
}

}  // namespace tools
