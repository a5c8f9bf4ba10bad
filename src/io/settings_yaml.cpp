// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/settings_yaml.hpp"

#include <yaml-cpp/yaml.h>

#include <map>
#include <set>
#include <stdexcept>

namespace unirit {
namespace {

/// What config/unirit.yaml tells the node, not the registration.
bool belongsToNode(const std::string& key) {
  static const std::set<std::string> keys{
      "auto_register", "every_cloud",  "fixed_frame",          "initial_alignment",
      "initial_pose",  "invert_tf",    "preprocessing/region", "preprocessing/region_frame",
      "publish_tf",    "sensor_frame", "stale_after",          "tf_rate",
      "tf_timeout",    "weights"};
  return keys.count(key) > 0;
}

/// The keys of nested maps joined by "/".
void flatten(const YAML::Node& map, const std::string& prefix,
             std::map<std::string, YAML::Node>& values) {
  for (const auto& entry : map) {
    const auto key = prefix + entry.first.as<std::string>();
    if (entry.second.IsMap()) {
      flatten(entry.second, key + "/", values);
    } else if (!values.emplace(key, entry.second).second) {
      throw std::runtime_error(key + " stands twice");
    }
  }
}

/// Takes the key out of `values` and reads it, where it is there.
template <class Value>
void take(const std::string& key, const char* kind, std::map<std::string, YAML::Node>& values,
          Value& value) {
  const auto found = values.find(key);
  if (found == values.end()) return;
  try {
    value = found->second.as<Value>();
  } catch (const YAML::Exception&) {
    throw std::runtime_error(key + " is not " + kind);
  }
  values.erase(found);
}

void parse(const std::string& path, RegistrationSettings& settings) {
  const YAML::Node root = YAML::LoadFile(path);
  if (!root.IsMap() && !root.IsNull()) throw std::runtime_error("it is not a list of settings");
  std::map<std::string, YAML::Node> values;
  if (root.IsMap()) flatten(root, "", values);

  visitSettings(settings, [&](const char* key, auto& value, auto, auto, const char*) {
    const bool is_whole = std::is_same_v<std::decay_t<decltype(value)>, int>;
    take(key, is_whole ? "a whole number" : "a number", values, value);
  });
  for (const WordSetting& word : wordSettings()) {
    std::string value = word.get(settings);
    take(word.name, "a word", values, value);
    word.set(settings, value);
  }
  validate(settings);
  for (const auto& [key, value] : values) {
    if (!belongsToNode(key)) throw std::runtime_error(key + " is not a setting");
  }
}

}  // namespace

void readSettings(const std::string& path, RegistrationSettings& settings) {
  RegistrationSettings read = settings;
  const std::string file = "Cannot use settings file \"" + path + "\": ";
  try {
    parse(path, read);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file + "it cannot be opened.");
  } catch (const std::exception& error) {
    throw std::runtime_error(file + error.what() + ".");
  }
  settings = read;
}

}  // namespace unirit
