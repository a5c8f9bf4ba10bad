// SPDX-License-Identifier: BSD-3-Clause
#include "parameters.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "parameter_names.hpp"

namespace unirit {
namespace {

/// Values of the shipped YAML file, as written, under names such as plausibility/min_points.
std::map<std::string, YAML::Node> leaves(const YAML::Node& node, const std::string& prefix = "") {
  std::map<std::string, YAML::Node> found;
  for (const auto& entry : node) {
    const auto name = prefix + entry.first.as<std::string>();
    if (entry.second.IsMap())
      found.merge(leaves(entry.second, name + "/"));
    else
      found[name] = entry.second;
  }
  return found;
}

TEST(Settings, yamlAndStructHoldTheSameDefaults) {
  auto yaml = leaves(YAML::LoadFile(UNIRIT_CONFIG));
  RegistrationSettings settings;
  visitSettings(settings, [&](const char* name, auto value, auto, auto, const char*) {
    ASSERT_EQ(yaml.count(name), 1U) << name;
    EXPECT_EQ(yaml[name].as<decltype(value)>(), value) << name;
    yaml.erase(name);
  });
  for (const WordSetting& word : wordSettings()) {
    EXPECT_EQ(yaml[word.name].as<std::string>(), word.get(settings)) << word.name;
    yaml.erase(word.name);
  }
  const NodeSettings node;
  EXPECT_EQ(yaml["auto_register"].as<bool>(), node.auto_register);
  EXPECT_EQ(yaml["every_cloud"].as<bool>(), node.every_cloud);
  EXPECT_EQ(yaml["stale_after"].as<double>(), node.stale_after);
  EXPECT_EQ(yaml["initial_pose"].size(), 0U);
  EXPECT_FALSE(node.initial_pose);
  EXPECT_EQ(yaml["initial_alignment"].as<std::string>(), node.initial_alignment);
  EXPECT_EQ(yaml["fixed_frame"].as<std::string>(), node.fixed_frame);
  EXPECT_EQ(yaml["sensor_frame"].as<std::string>(), node.sensor_frame);
  EXPECT_EQ(yaml["publish_tf"].as<bool>(), node.publish_tf);
  EXPECT_EQ(yaml["invert_tf"].as<bool>(), node.invert_tf);
  EXPECT_EQ(yaml["tf_rate"].as<double>(), node.tf_rate);
  EXPECT_EQ(yaml["tf_timeout"].as<double>(), node.tf_timeout);
  EXPECT_EQ(yaml["preprocessing/region"].size(), 0U);
  EXPECT_FALSE(node.region);
  EXPECT_EQ(yaml["preprocessing/region_frame"].as<std::string>(), node.region_frame);
  EXPECT_EQ(yaml.size(), 13U) << "a name in the file that nothing here compares";
}

TEST(Settings, readmeStatesTheSameDefaults) {
  std::ifstream file(UNIRIT_README);
  const std::string readme{std::istreambuf_iterator<char>(file), {}};
  const RegistrationSettings settings;
  visitSettings(settings, [&](const char* name, auto value, auto, auto, const char*) {
    const std::string row = std::string("| `") + name + "` | ";
    const auto found = readme.find(row);
    ASSERT_NE(found, std::string::npos) << name << " has no row";
    EXPECT_EQ(std::stod(readme.substr(found + row.size(), 20)), value) << name;
  });
}

TEST(Settings, dynamicThresholdsAndStructHoldTheSameDefaultsAndRanges) {
  const auto number = [](const UniritConfig& config, const std::string& name) {
    dynamic_reconfigure::Config values;
    config.__toMessage__(values);
    for (const auto& value : values.doubles)
      if (value.name == name) return value.value;
    for (const auto& value : values.ints)
      if (value.name == name) return static_cast<double>(value.value);
    ADD_FAILURE() << name << " is not in the cfg file";
    return 0.0;
  };
  RegistrationSettings settings;
  std::size_t thresholds = 0;
  visitSettings(settings,
                [&](const std::string& name, auto value, auto minimum, auto maximum, const char*) {
                  const std::string prefix = "plausibility/";
                  if (name.rfind(prefix, 0) != 0) return;
                  const std::string parameter = name.substr(prefix.size());
                  EXPECT_EQ(number(UniritConfig::__getDefault__(), parameter), value) << name;
                  EXPECT_EQ(number(UniritConfig::__getMin__(), parameter), minimum) << name;
                  EXPECT_EQ(number(UniritConfig::__getMax__(), parameter), maximum) << name;
                  ++thresholds;
                });
  EXPECT_EQ(UniritConfig::__getParamDescriptions__().size(), thresholds);
}

TEST(Settings, everyThresholdOfTheDynamicParametersArrives) {
  UniritConfig config = UniritConfig::__getMax__();
  RegistrationSettings settings;
  settings.plausibility = fromConfig(config);
  visitSettings(settings, [](const std::string& name, auto value, auto, auto maximum, const char*) {
    if (name.rfind("plausibility/", 0) != 0) return;
    EXPECT_EQ(value, maximum) << name;
  });
}

TEST(ParameterNames, thoseOfATreeAreJoinedBySlashes) {
  XmlRpc::XmlRpcValue tree;
  tree["stages"] = "rigid";
  tree["network"]["pairing"] = "none";
  tree["initial_pose"][0] = 1.0;
  EXPECT_EQ(leafNames(tree), (std::set<std::string>{"initial_pose", "network/pairing", "stages"}));
  EXPECT_TRUE(leafNames(XmlRpc::XmlRpcValue()).empty());
}

TEST(ParameterNames, aMisspeltOneLeadsToTheOneMeant) {
  const std::set<std::string> known{"plausibility/max_residual", "plausibility/min_points",
                                    "stages", "tf_rate", "fixed_frame"};
  EXPECT_EQ(nearestName("plausibilty/max_residual", known), "plausibility/max_residual");
  EXPECT_EQ(nearestName("plausibility/maxresiduum", known), "plausibility/max_residual");
  EXPECT_EQ(nearestName("max_residual", known), "plausibility/max_residual");
  EXPECT_EQ(nearestName("stage", known), "stages");
  EXPECT_EQ(nearestName("fixed_frame_id", known), "fixed_frame");
  EXPECT_EQ(nearestName("camera/width", known), "");
  EXPECT_EQ(nearestName("robot", known), "");
  EXPECT_EQ(nearestName("stage", {}), "");
}

TEST(ParameterNames, namespacesOfTheNodeAreItsOwn) {
  const std::set<std::string> known{"plausibility/max_residual", "stages"};
  EXPECT_TRUE(isInNamespaceOf("plausibility/limits/lowest", known));
  EXPECT_TRUE(isInNamespaceOf("plausibility", known));
  EXPECT_FALSE(isInNamespaceOf("stages/first", known));
  EXPECT_FALSE(isInNamespaceOf("plaus/max_residual", known));
}

}  // namespace
}  // namespace unirit
