@provenance@within;
package @package@ "@title@"
  block Plant "@title@"
@declarations@
  protected
    Real x_[@states@](start = {@start@}, each fixed = true, nominal = {@nominal@});
    Real u_[@inputs@] = {@input_names@};
    Real p_[@parameters@] = {@parameter_names@};
    Real o_[@outputs@];
  equation
    der(x_) = rates(x_, u_, p_);
    o_ = outputs(x_, u_, p_);
@equations@
  end Plant;

  function rates "Time derivatives of the states"
    input Real x[@states@];
    input Real u[@inputs@];
    input Real p[@parameters@];
    output Real f[@states@];
  external "C" model_modelica_rates(x, u, p, f)
    annotation (Include = "#include \"@file@_modelica.c\"", IncludeDirectory = "modelica://@package@/Resources/Include");
  end rates;

  function outputs "Outputs"
    input Real x[@states@];
    input Real u[@inputs@];
    input Real p[@parameters@];
    output Real o[@outputs@];
  external "C" model_modelica_outputs(x, u, p, o)
    annotation (Include = "#include \"@file@_modelica.c\"", IncludeDirectory = "modelica://@package@/Resources/Include");
  end outputs;
end @package@;
