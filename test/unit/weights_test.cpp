// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/weights.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "unirit/hash.hpp"
#include "weights_file_test.hpp"

namespace unirit {
namespace {

using WeightsFile = WeightsFileTest;

TEST(Sha256, isThatOfTheStandard) {
  EXPECT_EQ(sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Architecture, hasThePapersNumberOfParametersOrFarFewer) {
  const auto parameters = [](Pairing pairing) {
    long sum = 0;
    for (const LayerShape& shape : layerShapes(pairing)) sum += (shape.inputs + 1L) * shape.outputs;
    return sum;
  };
  EXPECT_EQ(parameters(Pairing::kNearest), 7466122);
  EXPECT_EQ(parameters(Pairing::kOffsets), 217302);
}

TEST_F(WeightsFile, comesBackAsItWasInHalfPrecision) {
  const Weights written = randomWeights(Pairing::kNearest, 1);
  const Weights read = readWeights(path("good"));
  EXPECT_EQ(read.pairing, Pairing::kNearest);
  ASSERT_EQ(read.layers.size(), written.layers.size());
  for (const auto& [name, layer] : written.layers) {
    const Layer& other = read.layers.at(name);
    EXPECT_EQ(other.weight, Eigen::MatrixXf(layer.weight.cast<Eigen::half>().cast<float>()));
    EXPECT_EQ(other.bias, layer.bias) << name;
  }
  EXPECT_LT(good_.size(), 15000000U);
  EXPECT_EQ((good_.size() - goodFile().data.size()) % 8, 0U) << "data must be aligned";
}

TEST_F(WeightsFile, carriesItsMetadataAndHash) {
  const Weights read = readWeights(path("good"));
  EXPECT_EQ(read.metadata.at("architecture"), "unirit");
  EXPECT_EQ(read.metadata.at("pairing"), "nearest");
  EXPECT_EQ(read.metadata.at("training_data"), "a \"phantom\", 3 µm\n");
  EXPECT_EQ(read.sha256, sha256Hex(good_));
}

TEST_F(WeightsFile, isTheSameAfterBeingReadAndWritten) {
  writeWeights(readWeights(path("good")), path("again"));
  EXPECT_EQ(readWeights(path("again")).sha256, sha256Hex(good_));
}

TEST_F(WeightsFile, remembersEveryPairing) {
  for (const Pairing pairing : {Pairing::kOffsets, Pairing::kNone, Pairing::kRow}) {
    writeWeights(randomWeights(pairing, 1), path("other"));
    EXPECT_EQ(readWeights(path("other")).pairing, pairing);
  }
}

TEST_F(WeightsFile, mayBeInSinglePrecision) {
  const Weights expected = readWeights(path("good"));
  Json header{{"__metadata__", expected.metadata}};
  std::string data;
  const auto add = [&](const std::string& name, const std::vector<long>& shape,
                       const auto& values) {
    const std::size_t begin = data.size();
    const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = values;
    data.append(reinterpret_cast<const char*>(rows.data()),
                sizeof(float) * static_cast<std::size_t>(rows.size()));
    header[name] = {{"dtype", "F32"}, {"shape", shape}, {"data_offsets", {begin, data.size()}}};
  };
  for (const auto& [name, layer] : expected.layers) {
    add(name + ".weight", {layer.weight.rows(), layer.weight.cols()}, layer.weight);
    add(name + ".bias", {layer.bias.size()}, layer.bias);
  }
  const Weights read = readWeights(write(File{header, data}.bytes()));
  for (const auto& [name, layer] : expected.layers) {
    EXPECT_EQ(read.layers.at(name).weight, layer.weight);
  }
}

TEST_F(WeightsFile, isNotWrittenFromUnfitWeights) {
  const auto expectUnfit = [](const Weights& weights, const std::string& words) {
    try {
      writeWeights(weights, path("unfit"));
      ADD_FAILURE() << "was written: " << words;
    } catch (const std::invalid_argument& fault) {
      EXPECT_NE(std::string(fault.what()).find(words), std::string::npos) << fault.what();
    }
    EXPECT_FALSE(fs::exists(path("unfit")));
  };
  const Weights good = readWeights(path("good"));
  Weights weights = good;
  weights.layers.erase("rigid.decoder.1");
  expectUnfit(weights, "\"rigid.decoder.1\" is missing");
  weights = good;
  weights.layers.at("rigid.decoder.1").bias.resize(3);
  expectUnfit(weights, "\"rigid.decoder.1\" is not 1024 x 1024");
  weights = good;
  weights.layers.at("rigid.decoder.1").weight(5, 6) = 1e6F;
  expectUnfit(weights, "\"rigid.decoder.1.weight\" does not fit in half precision");
  weights.layers.at("rigid.decoder.1").weight(5, 6) = std::nanf("");
  expectUnfit(weights, "\"rigid.decoder.1\" holds a value that is not finite");
  weights = good;
  weights.layers["rigid.decoder.9"] = {};
  expectUnfit(weights, "does not know");
}

TEST_F(WeightsFile, replacesAnOlderOneWholeOrNotAtAll) {
  const Weights good = readWeights(path("good"));
  const std::string nowhere = (folder_ / "no_such_folder" / "w.safetensors").string();
  try {
    writeWeights(good, nowhere);
    ADD_FAILURE() << "was written";
  } catch (const std::runtime_error& fault) {
    EXPECT_NE(std::string(fault.what()).find(nowhere), std::string::npos) << fault.what();
  }
  writeWeights(randomWeights(Pairing::kNearest, 2), path("replaced"));
  writeWeights(good, path("replaced"));
  EXPECT_EQ(readWeights(path("replaced")).sha256, good.sha256);
  EXPECT_FALSE(fs::exists(path("replaced") + ".tmp"));
}

}  // namespace
}  // namespace unirit
