#include "suggestion.hpp"

#include <vector>

#include "key_table.hpp"
#include "unflex/core/suggestion.hpp"

namespace unflex::machine {

std::string suggest_key(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Key& key : key_table()) {
    names.push_back(key.name);
  }
  return suggestion(name, names);
}

std::string suggest_section(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Key& key : key_table()) {
    names.push_back(key.name.substr(0, key.name.rfind('.')));
  }
  return suggestion(name, names);
}

}  // namespace unflex::machine
