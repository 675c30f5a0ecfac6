#include <string>
#include <vector>

#include "unflex/app/run.hpp"

int main(int argc, char** argv) {
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i) {
    arguments.emplace_back(argv[i]);
  }
  return unflex::app::run_program(arguments);
}
