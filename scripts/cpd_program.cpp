// SPDX-License-Identifier: BSD-3-Clause
// A command line for the library gadomski/cpd, which has none:
// cpd_program rigid|nonrigid SOURCE TARGET OUTPUT W ITERATIONS [BETA LAMBDA]
// ITERATIONS of 0: as many as the library itself would take.
#include <cpd/gauss_transform.hpp>
#include <cpd/nonrigid.hpp>
#include <cpd/rigid.hpp>
#include <fstream>
#include <memory>
#include <string>

int main(int argc, char** argv) {
  if (argc != 7 && argc != 9) return 2;
  const auto configure = [&](auto& transform) {
    transform.normalize(false);  // clouds are compared as they are
    transform.outliers(std::stod(argv[5]));
    if (const double iterations = std::stod(argv[6]); iterations > 0.0) {
      transform.max_iterations(iterations);
      transform.tolerance(0.0);
    }
    transform.gauss_transform(std::make_unique<cpd::GaussTransformDirect>());
  };
  const cpd::Matrix source = cpd::matrix_from_path(argv[2]);
  const cpd::Matrix target = cpd::matrix_from_path(argv[3]);
  std::ofstream output(argv[4]);
  const Eigen::IOFormat full(Eigen::FullPrecision, Eigen::DontAlignCols, " ", "\n");
  if (argv[1] == std::string("rigid")) {
    cpd::Rigid transform;
    configure(transform);
    output << transform.run(target, source).points.format(full) << '\n';
  } else {
    cpd::Nonrigid transform;
    configure(transform);
    transform.beta(std::stod(argv[7]));
    transform.lambda(std::stod(argv[8]));
    output << transform.run(target, source).points.format(full) << '\n';
  }
  return output.flush() ? 0 : 2;
}
