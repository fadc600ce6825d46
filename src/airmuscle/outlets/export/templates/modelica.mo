@provenance@within;
package @package@ "@title@"
  block Plant "@title@"
@declarations@
  protected
@values@
  equation
@equations@
  end Plant;

  function log1p "log(1 + x), also of a small x"
    input Real x;
    output Real y;
  protected
    Real u;
  algorithm
    u := 1.0 + x;
    y := if u > 1.0 or u < 1.0 then log(u) * x / (u - 1.0) else x;
  end log1p;

  function expm1 "exp(x) - 1, also of a small x"
    input Real x;
    output Real y;
  protected
    Real u;
  algorithm
    u := exp(x);
    y := if u > 1.0 or u < 1.0 then (u - 1.0) * (if abs(x) < 1.0 then x / log(u) else 1.0) else x;
  end expm1;

  function asinh "Inverse of sinh"
    input Real x;
    output Real y;
  algorithm
    y := if x < 0.0 then -log1p(-x + x * x / (1.0 + sqrt(x * x + 1.0))) else log1p(x + x * x / (1.0 + sqrt(x * x + 1.0)));
  end asinh;
end @package@;
