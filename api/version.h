#pragma once
#include <string>
#include <string_view>

namespace penumbra::api {

/// That of the program and of its documents, such as 1.1.0; api/CHANGELOG.md says what each brought.
std::string_view version();

/// 64 hexadecimal digits of what the engine's sources hold: equal ones render equal bytes.
std::string_view engine_hash();

/// The first twelve of them, for people.
std::string_view short_engine_hash();

/// "penumbra 1.1.0 (engine 0123456789ab)"
std::string program_name();

}  // namespace penumbra::api
