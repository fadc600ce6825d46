% An error for the first of parameters that is not finite or beyond its bounds.
function check_parameters(values, names, lowest, highest)
  values = values(:);
  if numel(values) ~= numel(names)
    error('%d parameters are given; give %d', numel(values), numel(names));
  end
  wrong = find(~(isfinite(values) & values >= lowest(:) & values <= highest(:)), 1);
  if ~isempty(wrong)
    error('%s is %.6g; allowed are %.6g to %.6g', names{wrong}, values(wrong), lowest(wrong), highest(wrong));
  end
end
