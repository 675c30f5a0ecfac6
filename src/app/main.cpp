#include "unflex/app/run.hpp"
#include "unflex/platform/process.hpp"

int main(int argc, char** argv) {
  return unflex::app::run_program(unflex::platform::arguments_of(argc, argv));
}
