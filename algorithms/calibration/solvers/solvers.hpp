/// The solvers themselves, one source file for each paper or pair of authors. All take a prepared Problem (two axes of
/// rotation at least, unless said otherwise) and use all views, or the motions between all pairs of views, so that no
/// order of the views matters. Where a paper gives axes equal weight, we weigh each by the angle of its motion: the
/// noise of an axis is inverse to the angle, and among all pairs there are many small angles. Equations of AX = YB are
/// written as A P = Q B (problem.hpp: View).
#pragma once

#include "algorithms/calibration/solvers/problem.hpp"

namespace firstlook::solvers {

/// Shiu and Ahmad 1987 (journal version 1989), "Calibration of wrist-mounted robotic sensors by solving homogeneous
/// transform equations of the form AX = XB". R = Rot(k_A, beta) R_P of each motion (thesis eq. 5-7, 5-8), linear in
/// cos(beta) and sin(beta): the equality of all motions' R in the least squares sense. The paper's system grows by two
/// unknowns with each motion; with the common R as an unknown and each pair of cosine and sine eliminated it stays 9 x
/// 9 and means the same. Translation: eq. 5-9. Half turns are left out.
[[nodiscard]] Result<HandEyeSolution> shiu_ahmad(const Problem& problem);

/// Tsai and Lenz 1989, "A new technique for fully autonomous and efficient 3D robotics hand/eye calibration": modified
/// Rodrigues vectors 2 sin(angle / 2) axis, eq. 12 for the rotation (thesis 5-10 to 5-13), eq. 15 for the translation.
/// Half turns are left out. The paper's singularity at a hand-eye rotation of 180 degrees is turned away from.
[[nodiscard]] Result<HandEyeSolution> tsai_lenz(const Problem& problem);

/// Zhuang and Roth 1991, "Comments on 'Calibration of wrist-mounted robotic sensors ...'": vector part of the
/// quaternion equation a x = x b, divided by the scalar of x: (a + b) x z = b - a. The same equations as Tsai and
/// Lenz's, but quaternions keep motions of 180 degrees. Their separate case of a hand-eye rotation of 180 degrees
/// (scalar 0) is brought to the general one by turning the camera's axes.
[[nodiscard]] Result<HandEyeSolution> zhuang_roth(const Problem& problem);

/// Chou and Kamel 1991, "Finding the position and orientation of a sensor on a robot manipulator using quaternions":
/// (a - b) x = 0 with a as left and b as right product, all four rows, the unit x by singular value decomposition.
[[nodiscard]] Result<HandEyeSolution> chou_kamel(const Problem& problem);

/// Wang 1992, "Extrinsic calibration of a vision sensor mounted on a robot", second of his three classes: the
/// difference k_A - k_B of every motion's axes is perpendicular to the axis of R, which two motions give by a cross
/// product (here all of them, by least squares), and the angle follows from the axes' parts perpendicular to it. Fails
/// where the axis of R lies in the plane of all motions' axes: the camera's axes are turned away from that. Half turns
/// are left out. His first class needs a target whose pose in the robot's base is known beforehand (no motions at all),
/// his third needs no target but motions of single joints by command: neither can be had from pose pairs.
[[nodiscard]] Result<HandEyeSolution> wang(const Problem& problem);

/// Park and Martin 1994, "Robot sensor calibration: solving AX = XB on the Euclidean group": R = (M^T M)^(-1/2) M^T
/// with M = sum of beta alpha^T over the rotation vectors, taken by singular value decomposition, which also covers
/// motions about two axes only. Half turns are left out.
[[nodiscard]] Result<HandEyeSolution> park_martin(const Problem& problem);

/// Horaud and Dornaika 1995, "Hand-eye calibration", closed form: the unit quaternion that minimises
/// sum of |alpha - q beta q*|^2 is an eigenvector. Half turns are left out.
[[nodiscard]] Result<HandEyeSolution> horaud_dornaika(const Problem& problem);

/// The same paper's nonlinear form: rotation and translation together minimise sum of |alpha - R beta|^2 +
/// |(R_A - I) t - R t_B + t_A|^2 (weights 1 for m and rad), started from the closed form. The paper's
/// penalty for the length of the quaternion is not needed: steps are rotations.
[[nodiscard]] Result<HandEyeSolution> horaud_dornaika_nonlinear(const Problem& problem);

/// Li and Betsis 1995, "Head-eye calibration", least squares over the canonical matrices: A = E_A C E_A^-1 and
/// B = E_B C E_B^-1 are the same screw motion C seen from two frames, so X = E_A Z E_B^-1 with a turn about and a shift
/// along the screw's axis as Z. Linear in R, t and each motion's Z (eliminated): 12 unknowns together, then R is made a
/// rotation and t solved again. Half turns are left out.
[[nodiscard]] Result<HandEyeSolution> li_betsis(const Problem& problem);

/// The same paper's nonlinear form, which its authors found best: minimises sum of |AX - XB|^2 (Frobenius norm, m) over
/// rotation and translation, started from Chou and Kamel's solution.
[[nodiscard]] Result<HandEyeSolution> li_betsis_nonlinear(const Problem& problem);

/// Daniilidis 1999, "Hand-eye calibration using dual quaternions": six equations of each motion in the eight numbers of
/// a dual quaternion; of the two dimensional null space the member of unit length whose dual part is
/// perpendicular. Where noise leaves no such member the nearest is taken.
[[nodiscard]] Result<HandEyeSolution> daniilidis(const Problem& problem);

/// Andreff, Horaud and Espiau 2001, "Robot hand-eye calibration using structure-from-motion": R_A R = R R_B and
/// (I - R_A) t + R t_B = t_A as one linear system of 12 unknowns by Kronecker products; then R is made a rotation and t
/// solved again. Only translations tell the scale of R: not for motion about one point (a wrist).
[[nodiscard]] Result<HandEyeSolution> andreff(const Problem& problem);

/// Zhuang, Roth and Sudhakar 1994, "Simultaneous robot/world and tool/flange calibration by solving homogeneous
/// transformation equations of the form AX = YB": a p = q b in quaternions, the scalar of q eliminated, divided by the
/// scalar of p: six unknowns. Their exceptions (a pose of 180 degrees, p of 180 degrees) are turned away from.
[[nodiscard]] Result<HandEyeSolution> zhuang(const Problem& problem);

/// Dornaika and Horaud 1998, "Simultaneous robot-world and hand-eye calibration", closed form: unit quaternions p and q
/// that minimise sum of |a p - q b|^2 are the leading singular vectors of a 4 x 4 matrix.
[[nodiscard]] Result<HandEyeSolution> dornaika_horaud(const Problem& problem);

/// The same paper's nonlinear form: minimises sum of |R_A R_P - R_Q R_B|^2 + |R_A t_P + t_A - R_Q t_B - t_Q|^2 (weights
/// 1, m) over both transforms, started from the closed form. The paper's penalties for orthogonality are not needed.
[[nodiscard]] Result<HandEyeSolution> dornaika_horaud_nonlinear(const Problem& problem);

/// Li, Wang and Wu 2010, "Simultaneous robot-world and hand-eye calibration using dual-quaternions and Kronecker
/// product", the Kronecker form: rotations and translations as 24 unknowns of one linear system, rotations then made
/// orthonormal, translations left as they are. Not for motion about one point (a wrist).
[[nodiscard]] Result<HandEyeSolution> li(const Problem& problem);

/// Ernst, Richter, Matthaus, Martens, Bruder, Schlaefer and Schweikard 2012, "Non-orthogonal tool/flange and
/// robot/world calibration", QR24: M X N^-1 - Y = 0 with 12 free numbers in each of X and Y by QR factorisation,
/// lengths in mm, which makes translations weigh a thousand times what they weigh in m. The matrices as solved are the
/// raw ones of the solution. Its transforms have the nearest rotations and translations solved again for these: the raw
/// translations belong to the raw matrices' scale. Not for motion about one point (a wrist).
[[nodiscard]] Result<HandEyeSolution> qr24(const Problem& problem);

/// The same, preconditioned: lengths divided by the RMS length of all translations, so that rotations and translations
/// weigh alike.
[[nodiscard]] Result<HandEyeSolution> qr24_preconditioned(const Problem& problem);

/// The same paper's QR15: the translation of the same equation only, which needs no rotation of the board: 12 numbers
/// of flange_T_camera and the board's position. Five views at least, and board positions in the camera that do not lie
/// in a plane. base_T_board is given when some views carry the board's rotation. Not for motion about one point (a
/// wrist).
[[nodiscard]] Result<HandEyeSolution> qr15(const Problem& problem);

/// Shah 2013, "Solving the robot-world/hand-eye calibration problem using the Kronecker product": vec(R_P) and vec(R_Q)
/// are the leading singular vectors of sum of R_B (x) R_A, each scaled to determinant 1 and made orthonormal; then both
/// translations by least squares.
[[nodiscard]] Result<HandEyeSolution> shah(const Problem& problem);

}  // namespace firstlook::solvers
