// Values of keys as text.
#pragma once

#include <optional>
#include <string>

#include "key_table.hpp"

namespace unflex::machine {

// As TOML writes it: "5000", "\"klipper\"", "[0, 250]", "true".
[[nodiscard]] std::string to_toml_value(double value);
[[nodiscard]] std::string to_toml_value(bool value);
[[nodiscard]] std::string to_toml_value(Firmware value);
[[nodiscard]] std::string to_toml_value(Kinematics value);
[[nodiscard]] std::string to_toml_value(const std::string& value);
[[nodiscard]] std::string to_toml_value(const Range& value);
[[nodiscard]] std::string to_toml_value(const Motors::Row& value);
[[nodiscard]] std::string to_toml_value(const Pair& value);
[[nodiscard]] std::string to_toml_value(const std::vector<ModeSettings>& value);
[[nodiscard]] std::string to_toml_value(const std::vector<PlantSettings>& value);
[[nodiscard]] std::string to_toml_value(const std::vector<FrequencyMap>& value);

// The value the key itself holds; nullopt while unset.
[[nodiscard]] std::optional<std::string> own_value(const Key& key, Draft& draft);

// The value in force: its own, or what follows from other keys; nullopt if there is neither.
[[nodiscard]] std::optional<std::string> value_in_force(const Key& key, Draft& draft);

// "> 0", "0 to 1", "klipper, marlin, rrf".
[[nodiscard]] std::string range_text(const Key& key);

}  // namespace unflex::machine
