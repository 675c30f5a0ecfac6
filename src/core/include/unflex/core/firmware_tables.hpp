// Tables of which every firmware has one, in its folder in src/firmware.
#pragma once

#include <array>
#include <cstddef>

#include "unflex/core/firmware.hpp"

// Declares unflex::firmware::<name>::table for every firmware. It stands in namespace unflex.
#define UNFLEX_FIRMWARE_TABLES(Table, table) UNFLEX_FIRMWARES(UNFLEX_FIRMWARE_TABLE, Table, table)
#define UNFLEX_FIRMWARE_TABLE(name, Table, table) \
  namespace firmware::name {                      \
  extern const Table table;                       \
  }

// The table of the firmware `which`.
#define UNFLEX_TABLE_OF(which, table) \
  (*std::array{UNFLEX_FIRMWARES(UNFLEX_TABLE_ADDRESS, table)}[static_cast<std::size_t>(which)])
#define UNFLEX_TABLE_ADDRESS(name, table) &firmware::name::table,
