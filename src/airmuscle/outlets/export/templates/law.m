function [value, by_first, by_second] = @file@(@first@, @second@, parameters)
@provenance@%
% The results are @results@ at @first@ [@first_unit@] and @second@ [@second_unit@], arrays of one size or numbers.
% parameters: those of the exported law unless given, in the order of
%   @names@
  if nargin < 3
    parameters = @defaults@;
  end
  names = @names@;
  check_parameters(parameters, names, @parameter_minimum@, @parameter_maximum@);
  c = prepare(parameters);
  shape = size(@first@ + @second@);
  @first@ = @first@ + zeros(shape);
  @second@ = @second@ + zeros(shape);
  value = zeros(shape);
  by_first = zeros(shape);
  by_second = zeros(shape);
  for k = 1:numel(value)
    result = evaluate(@first@(k), @second@(k), c);
    value(k) = result(1);
    by_first(k) = result(2);
    by_second(k) = result(3);
  end
end

@check_parameters@
@functions@
